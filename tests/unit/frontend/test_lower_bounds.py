"""What is proven of every plan: metres and steps that no engine can do without."""

from __future__ import annotations

import pytest

import missionc
from missionc.base.source import Source
from missionc.compiler.results import Verified
from missionc.frontend.checks.lower_bounds import LowerBounds, lower_bounds

LANES = """\
mission lanes
time step 1 s, horizon 30 s
world (0, 0) to (20, 12)
region a = box (16, 1) to (19, 4)
region b = box (16, 8) to (19, 11)
obstacle wall = box (9, 3) to (10, 9)
team r[3] { radius 0.3 m  dynamics single_integrator(speed <= 1.5 m/s)  start at (2, 2), (2, 6), (2, 10) }
separation 0.2 m
"""


def bounds(requirements: str) -> LowerBounds:
    checked = missionc.check(Source("lanes.mission", LANES + requirements))
    assert checked.mission is not None
    assert checked.kernel is not None
    return lower_bounds(checked.mission, checked.kernel)


@pytest.mark.parametrize(
    ("requirements", "metres", "steps"),
    [
        ("require go: r[0]: eventually[0, 30 s] a", 14.0, 10),
        ("require go: every r: eventually[0, 30 s] x >= 14 m", 36.0, 8),
        ("require go: some r: eventually[0, 30 s] a", 14.0, 10),
        ("require go: at least 2 r: eventually[0, 30 s] a", 14.0 + (14**2 + 2**2) ** 0.5, 10),
        ("require go: some r: eventually[0, 30 s] a\nrequire too: some r: eventually[0, 30 s] a", 14.0, 10),
        ("require go: r[0]: eventually[0, 30 s] a\nrequire too: some r: eventually[0, 30 s] a", 14.0, 10),
        ("require go: r[0]: eventually[0, 30 s] (a or x <= 4 m)", 0.0, 0),
        ("require stay: every r: always[0, end] x <= 14 m", 0.0, 0),
    ],
)
def test_whoever_has_to_be_somewhere_goes_the_straight_line_at_least(
    requirements: str, metres: float, steps: int
) -> None:
    found = bounds(requirements + "\n")
    assert found.metres == pytest.approx(metres, abs=1e-3)
    assert found.metres <= metres + 1e-9
    assert found.steps == steps


@pytest.mark.parametrize("backend", ["smt", "clot"])
def test_a_plan_says_how_far_it_is_from_what_is_proven_of_the_mission(backend: str) -> None:
    if backend == "clot":
        pytest.importorskip("torch")
    text = LANES + "require go: every r: eventually[0, 30 s] a\nminimize distance\n"
    outcome = missionc.compile(Source("lanes.mission", text), backend=backend).outcome
    assert isinstance(outcome, Verified)
    proven = outcome.plan.proven
    assert proven is not None
    assert 30 < proven.least <= outcome.plan.trace.metres == proven.value
