"""Every operator of space with lengths in hops and in metres, planned and verified for every kind of dynamics."""

from __future__ import annotations

import pytest

pytest.importorskip("torch")

from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.ir.language.operators import OPERATORS

DYNAMICS = {
    "single_integrator": "single_integrator(speed <= 2 m/s)",
    "double_integrator": "double_integrator(speed <= 2 m/s, acceleration <= 2 m/s^2)",
    "unicycle": "unicycle(speed 0..2 m/s)",
}
USES = {
    "reach": ("drone reach[hops 1..2] base", "drone reach[distance 0.5 m..4 m] base"),
    "escape": ("escape[hops 2..2] drone", "escape[distance 2.5 m..4 m] drone"),
    "somewhere": ("somewhere[hops 1..2] base", "somewhere[distance 0.5 m..4 m] base"),
    "everywhere": ("everywhere[hops 0..1] not base", "everywhere[distance <= 2 m] not base"),
    "count": ("count[hops 1..1] drone >= 2", "count[distance <= 2 m] drone >= 3"),
    "surround": ("goal surround[hops 0..1] base", "goal surround[distance <= 2 m] base"),
}
"""By operator, a use in hops and one in metres."""

OFTEN = {("unicycle", use) for name, (_, use) in USES.items() if name != "escape"}
"""Dynamics and uses that are planned whenever the tests run; the others take longer together."""

CASES = [
    pytest.param(
        dynamics, use, marks=() if (dynamics, use) in OFTEN else pytest.mark.slow, id=f"{use.split(']')[0]}] {dynamics}"
    )
    for dynamics in DYNAMICS
    for uses in USES.values()
    for use in uses
]


def text(use: str, dynamics: str) -> str:
    return f"""\
mission lengths
time step 1 s, horizon 6 s
world (0, 0) to (7, 7)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (4, 4) to (6, 6)
team drone[3] {{ radius 0.1 m  dynamics {DYNAMICS[dynamics]}  start in base }}
graph radio = proximity 2.5 m
require far: drone[0]: eventually[2 s, 6 s] (goal and {use})
"""


def test_no_operator_of_space_is_left_out() -> None:
    assert USES.keys() == {operator.name for operator in OPERATORS if operator.spatial}


@pytest.mark.parametrize(("dynamics", "use"), CASES)
def test_an_operator_is_planned(dynamics: str, use: str) -> None:
    found = driver.compile(Source("lengths.mission", text(use, dynamics)), time_limit=Seconds(3600))
    assert isinstance(found.outcome, Verified), found.outcome
