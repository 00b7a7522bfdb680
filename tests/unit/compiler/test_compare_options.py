"""Options of a plan compared: the better one is kept, within the work there is for it, and said."""

from __future__ import annotations

import math
import time

import pytest

from missionc.backends.api import Budget, Planned, Report
from missionc.backends.choose_backend import Choice
from missionc.backends.load import load
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.compiler.alternatives.compare_options import compare_options
from missionc.compiler.alternatives.restriction import Restriction
from missionc.compiler.alternatives.search_alternatives import quality
from missionc.compiler.driver import weighs_options
from missionc.compiler.front_end import check
from missionc.ir import Mission
from missionc.ir.kernel.choices import branches, made_once
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.signature import Signatures, differences
from missionc.verification.verify_plan import verify

NEAR_OR_FAR = """mission pick
time step 1 s, horizon 16 s
world (0, 0) to (24, 12)
region near = box (6, 9) to (9, 11)
region far  = box (19, 1) to (22, 4)
team rover[1] { radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start at (3, 6) }
require go: rover[0]: eventually[0, 16 s] (far or near)
minimize distance
"""

MOVING = NEAR_OR_FAR.replace(
    "minimize distance\n", "obstacle cart = disc at (12, 1) radius 0.5 moving (0 m/s, 0.5 m/s)\n"
)


def read(text: str) -> tuple[Mission, Kernel, Choice]:
    checked = check(Source("a.mission", text))
    assert checked.mission is not None
    assert checked.kernel is not None
    assert checked.choice is not None
    return checked.mission, checked.kernel, checked.choice


def budget(seconds: float = 60.0) -> Budget:
    return Budget(time.monotonic() + seconds)


def the_far_one(mission: Mission, kernel: Kernel) -> Planned:
    """A plan that takes the option that costs more, as a backend may that chose before it planned."""
    (choice,) = [asked for asked in made_once(kernel.requirements[0].formula) if branches(asked)]
    narrower = Restriction(removed={choice: frozenset({1})}).applied(mission, kernel)
    backend = load("smt")
    assert not isinstance(backend, Diagnostic)
    outcome = backend.plan(*narrower, Options(), budget())
    assert isinstance(outcome, Planned)
    return outcome


def test_the_option_that_costs_less_is_kept_and_the_other_is_said() -> None:
    mission, kernel, _ = read(NEAR_OR_FAR)
    far = the_far_one(mission, kernel)
    best = compare_options(mission, kernel, far, "smt", Options(), budget(), math.inf)
    assert best.trace.metres < far.trace.metres
    assert verify(mission, kernel, best.trace).passed
    assert any(note.startswith("other options: `go` by `far` instead of `near`: ") for note in best.report.notes)


def test_the_same_seed_compares_alike() -> None:
    mission, kernel, _ = read(NEAR_OR_FAR)
    far = the_far_one(mission, kernel)
    one, other = (compare_options(mission, kernel, far, "smt", Options(), budget(), math.inf) for _ in range(2))
    assert (one.trace.position == other.trace.position).all()
    assert one.report.notes == other.report.notes


def test_what_cannot_be_better_is_not_planned() -> None:
    mission, kernel, _ = read(NEAR_OR_FAR)
    far = the_far_one(mission, kernel)
    near = compare_options(mission, kernel, far, "smt", Options(), budget(), math.inf)
    again = compare_options(mission, kernel, near, "smt", Options(), budget(), math.inf)
    assert again is near


def test_a_comparison_that_time_ends_keeps_the_plan_and_says_so() -> None:
    mission, kernel, _ = read(NEAR_OR_FAR)
    far = the_far_one(mission, kernel)
    kept = compare_options(mission, kernel, far, "smt", Options(), budget(-1.0), math.inf)
    assert kept.trace is far.trace
    assert kept.report.cut_short is not None


def test_a_plan_that_keeps_the_margin_is_better_than_a_shorter_one() -> None:
    mission, kernel, _ = read(NEAR_OR_FAR)
    far = the_far_one(mission, kernel)
    near = compare_options(mission, kernel, far, "smt", Options(), budget(), math.inf)
    bare = Planned(near.trace, Report(kept=0.0))
    assert quality(mission, kernel, far) < quality(mission, kernel, bare)


@pytest.mark.parametrize(
    ("text", "engine", "weighs"),
    [
        (NEAR_OR_FAR, "clot", True),
        (MOVING, "clot", True),
        (NEAR_OR_FAR, "hybrid", True),
        (NEAR_OR_FAR, "smt", False),
        (NEAR_OR_FAR.replace("minimize distance\n", ""), "clot", False),
    ],
)
def test_options_are_weighed_where_a_backend_chose_by_an_estimate(text: str, engine: str, weighs: bool) -> None:
    mission, kernel, choice = read(text)
    planned = Planned(the_far_one(mission, kernel).trace, Report(engine=engine))
    assert weighs_options(mission, planned, choice) is weighs


def test_what_is_weighed_is_another_plan() -> None:
    mission, kernel, _ = read(NEAR_OR_FAR)
    far = the_far_one(mission, kernel)
    near = compare_options(mission, kernel, far, "smt", Options(), budget(), math.inf)
    signatures = Signatures(mission, kernel)
    assert differences(signatures.of(near.trace), signatures.of(far.trace)) == ("`go` by `far` instead of `near`",)
