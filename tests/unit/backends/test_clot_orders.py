"""What must not hold until, or while, something else does: events are put in an order and at times that allow it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

import missionc
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import MOST_OPTIONS, outline
from missionc.backends.clot.schedule.visits import Schedule
from missionc.base.source import Source
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Eventually
from tests.support.transport_missions import planned

HOUSE = """\
mission house
time step 0.5 s, horizon 20 s
world (0, 0) to (12, 12)
region door = box (3, 3) to (5, 5)
region key  = box (8, 8) to (10, 10)
team rover[2] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 1), (1, 5) }
require in: rover[0]: eventually[0, 20 s] door
"""
FIRST_THE_KEY = {
    "until": "require open: rover[0]: not door until[0, 20 s] key\n",
    "until, negated": "require open: rover[0]: not (not key until[0, 20 s] door)\n",
    "another has the key": "require open: (every rover: not door) until[0, 20 s] (rover[1]: key)\n",
    "late, negated": "require open: not ((rover[1]: not key) until[3 s, 20 s] (rover[0]: door))\n",
}
SIDES = """\
mission sides
time step 0.5 s, horizon 20 s
world (0, 0) to (12, 12)
region left  = box (0, 0) to (4, 12)
region right = box (8, 0) to (12, 12)
team rover[10] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start line (11, 1) to (11, 11) }
require stay: rover[0]: always[0, 20 s] x >= 5
require go:   eventually[0, 20 s] every rover: (left or right)
"""


def schedules(text: str, count: int = 1) -> tuple[Mission, list[Schedule]]:
    """The one without noise, and more with it."""
    checked = missionc.check(Source("a.mission", text), backend="clot")
    assert checked.mission is not None
    assert checked.kernel is not None
    mission = checked.mission
    asked, geodesics = outline(build(checked.kernel), mission.steps), Geodesics(mission)
    noises = [0.0] + [0.4] * (count - 1)
    return mission, [
        Scheduler(mission, asked, geodesics, np.random.default_rng(seed)).schedule(noise)
        for seed, noise in enumerate(noises)
    ]


@pytest.mark.parametrize("order", FIRST_THE_KEY)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_door_on_the_way_is_not_entered_before_the_far_key_is_had(order: str, seed: int) -> None:
    planned(HOUSE + FIRST_THE_KEY[order], seed)


@pytest.mark.parametrize("order", FIRST_THE_KEY)
def test_every_schedule_has_the_key_before_the_door(order: str) -> None:
    _, found = schedules(HOUSE + FIRST_THE_KEY[order], 10)
    for schedule in found:
        at = {type(each.visit.event.chooser): each.step for each in schedule.appointments}
        door = at.pop(Eventually)
        before = 6 if order.startswith("late") else 0  # until 3 s the door is nobody's business
        assert door < before or next(iter(at.values())) <= door
        assert schedule.late == 0


def test_an_event_waits_for_what_denies_it_to_be_over() -> None:
    mission, found = schedules(HOUSE + "require shut: rover[0]: always[2 s, 9 s] not door\n", 10)
    for schedule in found:
        (appointment,) = schedule.appointments
        assert not 2 <= appointment.step * mission.step <= 9
        assert schedule.late == 0


def test_a_schedule_that_denies_itself_says_by_how_much() -> None:
    _, (schedule,) = schedules(HOUSE + "require shut: rover[0]: always[1 s, 20 s] not door\n")
    assert schedule.late > 0


def test_of_more_options_than_are_looked_at_each_part_still_has_all_of_its_own() -> None:
    mission, _ = schedules(SIDES)
    checked = missionc.check(Source("a.mission", SIDES), backend="clot")
    assert checked.kernel is not None
    (task,) = outline(build(checked.kernel), mission.steps).tasks
    assert 0.5 * MOST_OPTIONS < len(task.options) <= MOST_OPTIONS
    taken = np.array([[each.part for each in option.events[0].decisions] for option in task.options])
    assert taken.shape[1] == 10
    assert ((taken == 0).any(axis=0) & (taken == 1).any(axis=0)).all()


def test_a_choice_for_ten_agents_at_once_is_made_as_each_of_them_needs_it() -> None:
    planned(SIDES)
