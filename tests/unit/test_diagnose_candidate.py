"""The diagnosis of a candidate that is no plan: who meets whom in which passage, who is late, and what follows."""

from __future__ import annotations

import numpy as np

from missionc.backends.acceptance import attempt
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.pipeline.diagnose_candidate import Diagnosis, diagnose
from missionc.pipeline.front_end import check

CANAL = """\
mission canal
time step 1 s, horizon 10 s
world (0, 0) to (20, 6)
obstacle north = box (4, 3.6) to (16, 6)
obstacle south = box (4, 0) to (16, 2.4)
region east = box (16.5, 0.5) to (19.5, 5.5)
agent up { radius 0.5 m dynamics single_integrator(speed <= 2 m/s) start at (5, 3) }
agent down { radius 0.5 m dynamics single_integrator(speed <= 2 m/s) start at (15, 3) }
require there: eventually[0, 10 s] up: east
"""


def _diagnosed(up: float, down: float) -> Diagnosis:
    """Of the motion in which both drive along the canal, at these speeds, metres a second."""
    checked = check(Source("canal.mission", CANAL))
    assert checked.mission is not None
    assert checked.kernel is not None
    clock = np.arange(11.0)
    along = np.stack([5 + up * clock, 15 + down * clock])
    position = np.stack([along, np.full_like(along, 3.0)], axis=-1)
    velocity = np.zeros_like(position)
    velocity[..., 0] = np.array([[up], [down]])
    trace = Trace(checked.mission.step, position, velocity, np.zeros(position.shape[:2]))
    return diagnose(checked.mission, checked.kernel, attempt(checked.mission, checked.kernel, trace))


def test_two_who_meet_head_on_are_told_how_wide_the_passage_is() -> None:
    found = _diagnosed(1.2, -1.0)
    meeting = next(note for note in found.notes if "meet" in note)
    assert "`up` and `down` meet near" in meeting
    assert "the passage is 1.2 m wide there, and two pass in 2 m" in meeting
    assert found.advice.startswith("widen the passage to 2 m")


def test_who_is_late_is_told_how_far_it_has_to_go_and_the_time_that_takes() -> None:
    found = _diagnosed(0.5, 0.0)
    assert found.notes == ("`up` is 6.5 m short of what `there` asks at 10 s",)
    assert found.advice == "allow at least 4 s more: horizon 14 s, and the windows that end with it"
    assert found.late
