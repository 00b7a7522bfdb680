"""Mission texts in the transport backend: checked, with demands and costs, planned."""

from __future__ import annotations

from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.settings import Spare, Weights
from missionc.base.continuous_time import ContinuousTime
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


def checked(
    text: str, backend: str = "clot", settings: dict[str, str] | None = None, **overrides: str
) -> tuple[Mission, Kernel]:
    """Mission and kernel of a text without errors."""
    found = driver.check(Source("a.mission", text), overrides={**overrides, **(settings or {})}, backend=backend)
    assert found.mission is not None, [finding.message for finding in found.findings]
    assert found.kernel is not None, [finding.message for finding in found.findings]
    return found.mission, found.kernel


def costs_and_demand(text: str) -> tuple[Costs, Demand]:
    """Costs of a mission's motions, and the demands of its requirements before any decision."""
    mission, kernel = checked(text)
    roots = tuple(wanted.formula for wanted in build(kernel).requirements)
    return Costs(mission, splines(mission), Weights(), Spare()), Demand.of(mission, roots, {}, mission.steps)


def planned(text: str, seed: int = 0) -> None:
    """Check that a plan is found and verified, at least at the steps."""
    once = ContinuousTime.AT_STEPS
    source = Source("a.mission", text)
    outcome = driver.compile(source, backend="clot", seed=seed, time_limit=Seconds(3600), continuous_time=once).outcome
    assert isinstance(outcome, Verified), outcome
