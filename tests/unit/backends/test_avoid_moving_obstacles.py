"""A team's way past obstacles that move, where they are at the time."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.api import Budget, Planned
from missionc.backends.clot.backend import BACKEND
from missionc.backends.clot.schedule.deconflict_space_time import avoid_moving_obstacles
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.options import Options
from missionc.base.trace import Array
from missionc.geometry.displacement import displaced
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance
from tests.support.transport_missions import checked

CROSSING = """mission crossing
time step 0.25 s, horizon 8 s
world (0, 0) to (10, 10)
region   goal = box (8, 4) to (9.5, 6)
obstacle cart = disc at (5, 1) radius 1 moving (0 m/s, SPEED m/s)
obstacle wall = box (4, 8) to (6, 10)
team rover[2] { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 5), (1, 5.6) }
require go: every rover: eventually[0, 8 s] goal
"""

START, END = np.array([1.0, 5.3]), np.array([8.7, 5.3])


def past(text: str) -> tuple[Mission, Array | None]:
    """The two rovers of a mission abreast, from left to right."""
    mission, _ = checked(text)
    times: Array = np.arange(1, mission.steps + 1) * float(mission.step)
    around = np.repeat(np.array([[[0.0, -0.3]], [[0.0, 0.3]]]), len(times), axis=1)
    middle = avoid_moving_obstacles(mission, [0, 1], around, times, START, END, Geodesics(mission))
    return mission, None if middle is None else middle + around


@pytest.mark.parametrize("speed", ["0.5", "1", "1.5", "2"])
def test_everybody_keeps_clear_of_what_moves_where_it_is_at_the_time(speed: str) -> None:
    mission, motion = past(CROSSING.replace("SPEED", speed))
    assert motion is not None
    for obstacle in mission.obstacles:
        for step in range(motion.shape[1]):
            moved = motion[:, step] - displaced(obstacle, (step + 1) * mission.step, 2)
            assert float(np.asarray(signed_distance(np, obstacle.shape, moved)).min()) > 0.0
    assert np.allclose(motion[:, -1].mean(axis=0), END)


@pytest.mark.parametrize("speed", ["0.5", "1", "1.5", "2"])
def test_nobody_is_much_faster_than_it_can_be(speed: str) -> None:
    mission, motion = past(CROSSING.replace("SPEED", speed))
    assert motion is not None
    assert np.linalg.norm(np.diff(motion, axis=1), axis=2).max() / mission.step < 1.5 * 2.0


def test_there_is_no_way_through_what_stands_from_side_to_side() -> None:
    near = CROSSING.replace("(8, 4) to (9.5, 6)", "(1, 7) to (2, 8)")
    _, motion = past(near.replace("SPEED", "1").replace("(4, 8) to (6, 10)", "(4, 0) to (6, 10)"))
    assert motion is None


@pytest.mark.parametrize("speed", ["2", "6"])
def test_a_file_that_would_meet_what_moves_leaves_its_route_at_the_first_attempt(speed: str) -> None:
    text = (Path(__file__).parents[3] / "missions" / "clot_dynamic.mission").read_text()
    mission, kernel = checked(text.replace("(every robot: upper) or ", ""), V=f"{speed} m/s")
    outcome = BACKEND.plan(mission, kernel, Options(), Budget(time.monotonic() + 60))
    assert isinstance(outcome, Planned)
    assert dict(outcome.report.sizes)["attempts"] == 1
