"""Which requirements keep others safe, and which motions give that up."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.compiler.relax.search_relaxations import gives_up_safety, guards
from tests.support.legal_plans import straight
from tests.support.unpacked_reports import plotted

TEXT = """\
mission crossing
time step 1 s, horizon 4 s
world (0, 0) to (10, 6)
separation 0.2 m
region people = box (4, 0) to (6, 6)
region goal = box (7, 0) to (10, 6)
region dock = box (0, 0) to (2, 6)
team drone[2] {
  radius 0.1 m
  dynamics single_integrator(speed <= 9 m/s)
  start in dock
}
graph radio = proximity 9 m
require subject: FORMULA
"""

STAY = [[[1.0, 1.0]] * 5, [[1.0, 3.0]] * 5]


@pytest.mark.parametrize(
    ("formula", "safe"),
    [
        ("every drone: always[0, 4 s] not people", True),
        ("every drone: always[0, 4 s] dock", True),
        ("every drone: (not people) until[0, 4 s] goal", True),
        ("every drone: always[0, 4 s] (goal implies true reach[hops 0..1 on radio] dock)", True),
        ("(every drone: eventually[0, 4 s] goal) and (every drone: always[0, 4 s] not people)", True),
        ("every drone: eventually[0, 4 s] goal", False),
        ("every drone: always[0, 2 s] eventually[0, 2 s] dock", False),
        ("every drone: dock until[0, 4 s] goal", False),
        ("some drone: eventually[0, 4 s] not people", False),
    ],
)
def test_who_always_keeps_something_keeps_others_safe_and_who_waits_does_not(formula: str, safe: bool) -> None:
    (goal,) = plotted(TEXT.replace("FORMULA", formula), STAY).kernel.requirements
    assert guards(goal.formula) == safe


def gives_up(formula: str, motion: list[list[list[float]]]) -> bool:
    made = plotted(TEXT.replace("FORMULA", formula), STAY)
    return gives_up_safety(made.mission, made.kernel, straight(np.array(motion), made.mission.step))


THROUGH = [[[1.0, 1.0], [3.0, 1.0], [5.0, 1.0], [8.0, 1.0], [8.0, 1.0]], STAY[1]]


def test_a_motion_through_people_gives_up_who_keeps_out() -> None:
    assert gives_up("every drone: always[0, 4 s] not people", THROUGH)
    assert not gives_up("every drone: always[0, 4 s] not people", STAY)
    assert not gives_up("every drone: eventually[0, 4 s] goal", STAY)


def test_bodies_nearer_than_the_room_that_is_asked_for_give_it_up() -> None:
    assert gives_up("every drone: eventually[0, 4 s] goal", [STAY[0], [[1.0, 1.3]] * 5])


def test_in_a_longer_mission_a_guard_lasts_to_its_end() -> None:
    late = [[[1.0, 1.0]] * 5 + [[5.0, 1.0]], [[1.0, 3.0]] * 6]
    assert gives_up("every drone: always[0, 4 s] not people", late)
    assert not gives_up("every drone: always[0, 3 s] not people", late)
    assert not gives_up("every drone: always[0, 4 s] not people", [[[1.0, 1.0]] * 6, [[1.0, 3.0]] * 6])


def test_of_other_agents_nothing_is_said() -> None:
    assert not gives_up("every drone: always[0, 4 s] not people", [*THROUGH, STAY[1]])
