"""What attempts of the transport backend begin with, where nothing but links holds a team together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.run.initial_guesses import InitialGuesses
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.tasks import Event, outline
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.front_end import check
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import Kernel

HUTS = """\
mission huts
time step 2 s, horizon 80 s
world (0, 0) to (60, 40)
obstacle lake = disc at (30, 20) radius 5 m
region west = box (4, 4) to (9, 9)
region north = box (4, 31) to (9, 36)
region east = box (51, 4) to (56, 9)
team ranger[2] { radius 0.5 m  dynamics single_integrator(speed <= 4 m/s)  start at (15, 20), (20, 20) }
graph radio = proximity RANGE
require a: always[0, 40 s] eventually[0, 40 s] (some ranger: west)
require b: always[0, 40 s] eventually[0, 40 s] (some ranger: north)
require c: always[0, 40 s] eventually[0, 40 s] (some ranger: east)
require net: always[0, 80 s] connected(radio)
"""
ROW = "formation row = line of ranger spacing 3 m tolerance 1 m\nrequire row: eventually[0, 80 s] row\n"
WIDE, NARROW = (HUTS.replace("RANGE", each) for each in ("75 m", "20 m"))


def beginnings(text: str) -> InitialGuesses:
    checked = check(Source("a.mission", text), backend="clot")
    assert checked.mission is not None
    assert isinstance(checked.kernel, Kernel)
    mission, graph = checked.mission, build(checked.kernel)
    asked = outline(graph, mission.steps)
    return InitialGuesses(mission, checked.kernel, graph, asked, Geodesics(mission), lambda: True, lambda: None)


def motion(text: str, number: int) -> np.ndarray:
    return beginnings(text).begun(number, np.random.default_rng([0, number])).motion


def spread(text: str, number: int) -> float:
    """How far the two are from each other at most, metres."""
    made = motion(text, number)
    return float(np.linalg.norm(made[0] - made[1], axis=-1).max())


def test_the_first_attempt_begins_with_tours_where_they_keep_the_links() -> None:
    assert spread(WIDE, 0) > 40


def test_it_begins_with_a_team_that_goes_together_where_tours_do_not() -> None:
    assert spread(NARROW, 0) <= 20


def test_another_attempt_begins_with_tours_all_the_same() -> None:
    assert spread(NARROW, 1) > 40


def test_who_is_to_be_in_formation_never_begins_with_a_tour() -> None:
    assert spread(WIDE + ROW, 0) < 20
    assert spread(WIDE + ROW, 1) < 20


def test_a_beginning_is_the_same_each_time() -> None:
    assert np.array_equal(motion(NARROW, 1), motion(NARROW, 1))


def test_places_are_visited_again_and_again_by_agents_in_touch() -> None:
    outcome = driver.compile(Source("a.mission", WIDE), backend="clot").outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["attempts"] == 1


def test_places_that_one_moment_would_do_for_are_visited_twice() -> None:
    (chain,) = {
        len(visits)
        for task in beginnings(WIDE).asked.tasks
        for option in task.options
        for visits in [list(chained(option.events))]
    }
    assert chain == 2, "a visit at 40 s alone is in every window, but one ranger can be in one place then"


def chained(events: tuple[Event, ...]) -> Iterator[Event]:
    for event in events:
        yield event
        yield from chained(event.then)
