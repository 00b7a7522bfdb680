"""Moves of a roadmap that are slow where a formula limits the speed, and fast elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

import missionc
from missionc.backends.smt.roadmap.roadmap import Roadmap, build_roadmaps
from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.compiler.results import Verified

YARD = """\
mission night
time step 1 s, horizon 80 s
world (0, 0) to (40, 12)
region yard = box (12, 0) to (28, 12)
region lab  = box (32, 2) to (38, 10)
team rover[2] { radius 0.3 m dynamics single_integrator(speed <= 2 m/s) start at (3, 3), (3, 9) }
require bring: every rover: eventually[0, 70 s] lab
"""
QUIET = "require quiet: every rover: always[0, WHEN] (yard implies speed <= 0.5)\n"


def roadmap_of(text: str) -> Roadmap:
    checked = check(Source("night.mission", text))
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None, checked.findings
    roadmaps = build_roadmaps(checked.mission, 110, 6, np.random.default_rng(0), kernel=checked.kernel)
    assert isinstance(roadmaps, tuple)
    return roadmaps[0]


def speeds(roadmap: Roadmap) -> tuple[np.ndarray, np.ndarray]:
    """The speed of each move, and whether it touches the yard at an end: (moves,) each."""
    ends = roadmap.position[roadmap.moves]
    touches = ((ends[..., 0] >= 12) & (ends[..., 0] <= 28)).any(axis=1)
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1), touches


def test_moves_are_slow_in_the_yard_and_fast_outside() -> None:
    speed, touches = speeds(roadmap_of(YARD + QUIET.replace("WHEN", "end")))
    assert speed[touches].max() <= 0.5
    assert 1.5 < speed[~touches].max() <= 2 + 1e-9


@pytest.mark.parametrize("more", ["", QUIET.replace("WHEN", "30 s")])
def test_where_the_yard_may_be_crossed_fast_there_are_fast_moves_too(more: str) -> None:
    speed, touches = speeds(roadmap_of(YARD + more))
    assert speed[touches].max() > 1.5


def test_a_slow_yard_is_crossed_on_a_roadmap() -> None:
    outcome = missionc.compile(Source("night.mission", YARD + QUIET.replace("WHEN", "end")), backend="smt").outcome
    assert isinstance(outcome, Verified)
