"""The diagnosis of a candidate that is no plan: who meets whom in which passage, who is late, and what follows."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.backends.acceptance import attempt
from missionc.backends.clot.run.run_state import failure_statement
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.compiler.diagnose_candidate import Diagnosis, diagnose
from missionc.compiler.front_end import check

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


def _diagnosed(*speeds: float, mission: str = CANAL, gather: int | None = None) -> Diagnosis:
    """Of the motion in which all drive along the canal, at these speeds, metres a second.

    All from ``gather`` on are at the place of the first of them.
    """
    checked = check(Source("canal.mission", mission))
    assert checked.mission is not None
    assert checked.kernel is not None
    starts = np.array([agent.start.point for agent in checked.mission.agents])  # type: ignore[union-attr]
    position = np.repeat(starts[:, None], checked.mission.steps + 1, axis=1)
    if gather is not None:
        position[gather:] = position[gather] + 0.1 * np.arange(len(starts) - gather)[:, None, None]
    position[..., 0] += np.array(speeds)[:, None] * np.arange(checked.mission.steps + 1.0)
    velocity = np.zeros_like(position)
    velocity[..., 0] = np.array(speeds)[:, None]
    trace = Trace(checked.mission.step, position, velocity, np.zeros(position.shape[:2]))
    return diagnose(checked.mission, checked.kernel, attempt(checked.mission, checked.kernel, trace))


def test_two_who_meet_head_on_are_told_how_wide_the_passage_is() -> None:
    found = _diagnosed(1.2, -1.0)
    meeting = next(note for note in found.notes if "meet" in note)
    assert "`up` and `down` meet near" in meeting
    assert "the passage is 1.2 m wide, but two agents need 2 m" in meeting
    assert found.advice.startswith("widen the passage to 2 m")


def test_who_could_have_waited_outside_is_told_to() -> None:
    found = _diagnosed(1.2, -1.5, mission=CANAL.replace("at (15, 3)", "at (17.5, 3)"))
    assert found.advice == ("allow more time, so that `up` or `down` can wait outside the passage")


def test_who_stays_in_a_passage_is_told_to_make_way() -> None:
    found = _diagnosed(1.2, -0.05)
    assert found.advice == "widen the passage to 2 m"


def test_a_passage_is_not_to_blame_where_nobody_wants_past_the_other() -> None:
    found = _diagnosed(0.95, -0.01)
    assert any("meet" in note for note in found.notes)
    assert not any("passage" in note for note in (*found.notes, found.advice))


def test_who_is_late_is_told_how_far_it_has_to_go_and_the_time_that_takes() -> None:
    found = _diagnosed(0.5, 0.0)
    assert found.notes == ("`up` is 6.5 m short of `there` at 10 s",)
    assert found.advice == "allow at least 4 s more: extend the horizon and its windows to 14 s"
    assert found.late


def test_a_window_that_ends_before_the_horizon_is_what_is_to_be_longer() -> None:
    inner = CANAL.replace("horizon 10 s", "horizon 12 s")
    assert _diagnosed(0.5, 0.0, mission=inner).advice == (
        "allow `there` at least 4 s more, until 14 s, and a horizon of 14 s"
    )
    enough = CANAL.replace("horizon 10 s", "horizon 20 s")
    assert _diagnosed(0.5, 0.0, mission=enough.replace("(15, 3)", "(18.5, 4)")).advice == (
        "allow `there` at least 4 s more, until 14 s"
    )


def test_who_goes_too_fast_needs_the_time_that_it_gains_by_that() -> None:
    found = _diagnosed(2.1, 0.0, mission=CANAL.replace("(15, 3)", "(19, 5)").replace("to (20, 6)", "to (40, 6)"))
    assert found.notes == ("`up` exceeds its top speed and would arrive 0.5 s late",)
    assert found.advice == "allow `up` at least 1 s more for its path"
    assert found.late


def test_who_is_late_and_breaks_more_is_told_no_figure_that_would_not_do() -> None:
    found = _diagnosed(0.5, 0.0, mission=CANAL + "require slow: always[0, 9 s] (up: speed <= 0.3)\n")
    assert found.advice == "allow `there` more time"


def test_a_speed_that_is_missed_is_no_way_to_go() -> None:
    slow = CANAL.replace("up: east", "(up: speed >= 1)")
    found = _diagnosed(0.5, 0.0, mission=slow)
    assert found.notes == ()
    assert not found.late


def test_what_is_missed_is_told_in_its_own_unit() -> None:
    slow = CANAL.replace("up: east", "(up: speed >= 1)")
    checked = check(Source("canal.mission", slow))
    assert checked.mission is not None
    assert checked.kernel is not None
    position = np.repeat(np.array([[[5.0, 3.0]], [[15.0, 3.0]]]), 11, axis=1)
    position[1, :, 0] -= 2.5 * np.arange(11)
    still = Trace(checked.mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))
    come_to = attempt(checked.mission, checked.kernel, still)
    says = failure_statement(come_to, None, checked.mission)
    assert says.startswith("the best candidate violates `there` of up at 10 s by 1 m/s; the world's bounds of down")
    assert "its speed of down at 0 s by 0.5 m/s" in says


@pytest.mark.parametrize(("bots", "speed", "more"), [(3, 1.0, "1 more pair meets"), (4, 0.0, "3 more pairs meet")])
def test_one_more_pair_is_one_pair(bots: int, speed: float, more: str) -> None:
    dynamics = "dynamics single_integrator(speed <= 2 m/s)"
    team = f"team bot[{bots}] {{ radius 0.5 m {dynamics} start grid (0.5, 0.5) to (3.5, 5.5) }}\n"
    found = _diagnosed(speed, -speed, *[0.0] * bots, mission=CANAL + team, gather=2)
    assert more in found.notes
