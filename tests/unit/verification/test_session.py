"""A session from line to line: every event it tells, of a flight in steps of half a second."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.verification.monitoring.live.samples import Fate
from missionc.verification.monitoring.live.session import (
    Change,
    Event,
    Forecast,
    Implausible,
    Judged,
    Outrun,
    Presence,
    Session,
    Unusable,
)
from missionc.verification.monitoring.live.verdicts import LiveVerdict
from tests.support.live_flights import FLIGHT, line

TEXT = """mission flight
time  step 0.5 s, horizon 2 s
world (0, 0) to (6, 6)
region goal = box (4, 4) to (5.5, 5.5)
team drone[2] { dynamics single_integrator(speed <= 2 m/s)  start at (3, 3), (2, 1) }
require there: drone[0]: eventually[0, 2 s] goal
require slow:  drone[1]: always[0, 2 s] speed <= 1.5 m/s
require apart: always[0, 2 s] distance(drone[0], drone[1]) >= 0.5
prefer west:   drone[1]: always[0, 2 s] x <= 3
"""


def session(text: str = TEXT, **options: float) -> Session:
    checked, _ = driver.live_session(Source("flight.mission", text))
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None, checked.findings
    return Session(checked.mission, checked.kernel, **options)  # type: ignore[arg-type]


def told(events: list[Event]) -> list[object]:
    """The events, of steps that were judged their number alone; of goals, what is said of them and is no number."""
    found: list[object] = []
    for event in events:
        match event:
            case Change(step, standing, unit, preference, by_plan):
                found.append((step, standing.name, standing.verdict.value, standing.at_risk, unit, preference, by_plan))
            case Judged(state):
                found.append(state.step)
            case _:
                found.append(event)
    return found


def fast(time: float, *places: tuple[float, float], **more: float) -> str:
    """A line of the second drone, with its velocity."""
    record = {"t": time, "agent": "drone[1]", "position": places[0], "velocity": [0, 0]}
    return json.dumps(record | more)


def first(time: float, x: float, y: float) -> str:
    return json.dumps({"t": time, "agent": "drone[0]", "position": [x, y]})


def fed(session: Session, *lines: str) -> list[object]:
    return told([event for each in lines for event in session.feed(each)])


def test_the_first_step_tells_of_every_goal_and_later_ones_of_what_changes() -> None:
    live = session()
    begin = fed(live, first(0, 3.5, 4.5), fast(0, (2, 1)))
    assert begin == [
        (0, "there", "open", False, "m", False, None),
        (0, "slow", "open", False, "m/s", False, None),
        (0, "apart", "open", False, "m", False, None),
        (0, "west", "open", False, "m", True, None),
        0,
    ]
    assert (live.verdict, live.over, live.lines) == (LiveVerdict.OPEN, False, 2)
    assert fed(live, first(0.5, 4.25, 4.5), fast(0.5, (2, 1))) == [
        (1, "there", "satisfied", False, "m", False, None),
        1,
    ]
    # Who goes a metre and a half in a step is too fast, and at 3.5 m too far east for good.
    assert fed(live, first(1, 4.25, 4.5), fast(1, (3.5, 1))) == [
        Outrun(2, ("drone[1]",)),
        (2, "west", "violated", False, "m", True, None),
        2,
    ]
    assert live.verdict is LiveVerdict.OPEN
    for time in (1.5, 2):
        fed(live, first(time, 4.25, 4.5), fast(time, (3.5, 1)))
    assert (live.over, live.verdict) == (True, LiveVerdict.SATISFIED)
    assert live.notes() == ["drone[1] exceeded the top speed"]


def test_a_goal_at_risk_is_told_before_it_is_lost() -> None:
    """Two metres short of the goal, with two steps of a metre left."""
    live = session()
    fed(live, first(0, 2, 5), fast(0, (2, 1)), first(0.5, 2, 5), fast(0.5, (2, 1)))
    away = fed(live, first(1, 2, 5), fast(1, (2, 1)))
    assert away == [(2, "there", "open", True, "m", False, None), 2]
    assert fed(live, first(1.5, 2, 5), fast(1.5, (2, 1))) == [
        (3, "there", "violated", False, "m", False, None),
        (3, "apart", "satisfied", False, "m", False, None),
        3,
    ]
    assert live.verdict is LiveVerdict.VIOLATED


def test_who_is_missing_is_told_and_who_is_back() -> None:
    live = session()
    fed(live, first(0, 5, 5), fast(0, (2, 1)))
    gone = fed(live, first(0.5, 5, 5), first(1, 5, 5), first(1.25, 5, 5))
    assert gone == [Presence(1, ("drone[1]",), ()), 1]
    assert live.missing == {1}
    back = fed(live, fast(1.5, (2, 1)), first(1.5, 5, 5), first(1.75, 5, 5))
    assert back[0] == 2
    assert back[1] == Presence(3, (), ("drone[1]",))
    assert fed(session(), first(0, 5, 5), first(0.75, 5, 5))[0] == Presence(0, ("drone[1]",), ())


BETWEEN = """mission between
time  step 1 s, horizon 2 s
world (0, 0) to (10, 10)
region goal = box (4, 4) to (6, 6)
team drone[2] { radius 0.1 m  dynamics single_integrator(speed <= 9 m/s)  start in goal }
require keep: every drone: always[0, 2 s] goal
"""


def test_a_state_between_samples_decides_nothing_for_good_while_a_sample_of_it_may_come() -> None:
    """The first drone is outside at 1 s alone; that sample comes after the one of 1.5 s."""
    live = session(BETWEEN)
    fed(live, first(0, 5, 5), fast(0, (5.5, 5.5)), first(0.5, 5.9, 5), fast(1, (5.5, 5.5)))
    assert fed(live, first(1.5, 5.9, 5)) == [1]
    assert live.standings[0].most == 0.5
    assert fed(live, first(1, 6.8, 5)) == [(1, "keep", "violated", False, "m", False, None), 1]
    assert live.standings[0].most == pytest.approx(-0.8)
    fed(live, first(2, 5, 5), fast(2, (5.5, 5.5)))
    assert (live.over, live.verdict) == (True, LiveVerdict.VIOLATED)


def test_a_state_between_samples_is_taken_for_good_when_the_wait_is_over() -> None:
    live = session(BETWEEN)
    fed(live, first(0, 5, 5), fast(0, (5.5, 5.5)), first(0.5, 5.9, 5), fast(1, (5.5, 5.5)))
    fed(live, first(1.5, 6.5, 5))
    # On the way it was at (6.2, 5), which a further sample may deny.
    assert live.verdict is LiveVerdict.OPEN
    fed(live, fast(2, (5.5, 5.5)), first(2.25, 6.5, 5))
    assert live.verdict is LiveVerdict.OPEN
    assert fed(live, first(2.5, 6.5, 5))[0] == (1, "keep", "violated", False, "m", False, None)
    assert (live.steps.closed, live.steps.settled) == (3, 2)


def test_a_line_that_says_nothing_is_counted_and_one_that_cannot_be_used_is_told() -> None:
    live = session()
    assert fed(live, "", "  \n") == []
    (found,) = fed(live, "{}")
    assert found == Unusable(3, "`t` is not a finite number")
    assert fed(live, "[") != []
    assert (live.lines, live.unusable) == (4, 2)
    assert live.notes() == ["2 lines could not be used"]


def test_a_third_coordinate_is_told_once_at_the_end() -> None:
    live = session()
    lines = [json.dumps({"t": time, "agent": "drone[0]", "position": [3, 3, 1]}) for time in (0, 0.5)]
    assert fed(live, *lines) == []
    assert live.notes() == ["the mission is two-dimensional: the third coordinate of samples was ignored"]


def test_no_number_is_larger_than_the_limit_that_is_given() -> None:
    checked, _ = driver.live_session(Source("flight.mission", TEXT))
    assert checked.mission is not None
    assert checked.kernel is not None
    narrow = Session(checked.mission, checked.kernel, Limits(magnitude=10.0))
    (found,) = fed(narrow, first(0, 11, 3))
    assert found == Unusable(1, "`position` of `drone[0]` is 11; the limit is 10")


def test_a_sample_too_far_ahead_is_told_by_its_line() -> None:
    live = session()
    fed(live, first(0, 3, 3), fast(0, (2, 1)))
    assert fed(live, first(99, 3, 3)) == [Implausible(3, "drone[0]", 99.0)]
    assert live.notes() == ["1 sample dropped: too far ahead in time, without confirmation"]
    near = session(leap=0.5)
    fed(near, first(0, 3, 3), fast(0, (2, 1)))
    assert fed(near, first(0.75, 3, 3)) == [Implausible(3, "drone[0]", 0.75)]


def test_notes_say_what_became_of_samples() -> None:
    live = session()
    fed(live, first(0, 3, 3), fast(0, (2, 1)), first(-1, 3, 3), first(0.4, 3, 3), first(0.2, 3, 3), first(0.2, 3, 3))
    assert live.notes() == [
        "1 sample dropped: too late for its step",
        "1 sample dropped: same agent and time as another",
        "1 sample sorted: out of order",
    ]
    live.steps.fates[Fate.LATE] = 2
    assert live.notes()[0] == "2 samples dropped: too late for its step"


def test_clocks_are_put_right_and_the_wait_is_the_one_that_is_given() -> None:
    checked, _ = driver.live_session(Source("flight.mission", TEXT))
    assert checked.mission is not None
    assert checked.kernel is not None
    skewed = Session(checked.mission, checked.kernel, skew={0: 0.25})
    assert fed(skewed, first(0.25, 3, 3), fast(0, (2, 1)))[-1] == 0
    patient = session(wait=2.0)
    assert fed(patient, first(0, 3, 3), first(1.5, 3, 3)) == []
    assert fed(patient, first(2.25, 3, 3))[-1] == 0


def test_a_stream_that_ends_is_judged_as_far_as_it_got() -> None:
    live = session()
    fed(live, first(0, 3, 3), fast(0, (2, 1)), first(0.5, 3, 3), first(0.75, 3, 3))
    assert told(list(live.finish())) == [Presence(1, ("drone[1]",), ()), 1]
    assert live.over is False


def plan(*xs: float) -> Trace:
    """The first drone along y = 5, the other where it starts."""
    position = np.array([[(x, 5.0) for x in xs], [(2.0, 1.0)] * len(xs)])
    return Trace(Seconds(0.5), position, np.zeros_like(position), np.zeros(position.shape[:2]))


def test_what_the_plan_would_come_to_is_told_with_each_change_and_where_it_would_be_lost() -> None:
    live = session()
    live.follow(plan(2, 2, 3, 4, 4.5))
    begin = fed(live, first(0, 2, 5), fast(0, (2, 1)))
    # In the goal by half a metre at the end; 1.5 m/s to spare; a metre west of 3 m; 4 m and more apart.
    assert begin[0] == (0, "there", "open", False, "m", False, 0.5)
    assert begin[1] == (0, "slow", "open", False, "m/s", False, 1.5)
    assert begin[2] == (0, "apart", "open", False, "m", False, pytest.approx(np.sqrt(16.0) - 0.5))
    assert begin[3:] == [(0, "west", "open", False, "m", True, 1.0), 0]
    assert dict(live.by_plan) == {0: 0.5, 1: 1.5, 2: pytest.approx(3.5), 3: 1.0}
    # Where it is now, the second one would be half a metre too far; so it would be until it is decided.
    lost = fed(live, first(0.5, 2, 5), fast(0.5, (2.9, 1)))
    assert lost == [1]
    live.follow(plan(2, 2, 2, 2, 2))
    away = fed(live, first(1, 3, 5), fast(1, (2.9, 1)))
    assert away == [Forecast(2, "there", -1.0, "m", False), 2]
    # Told once, as long as it stays so.
    again = fed(live, first(1.5, 3, 5), fast(1.5, (2.9, 1)))
    assert not any(isinstance(event, Forecast) for event in again)
    live.follow(plan(2, 2, 3, 4, 4.5))
    assert fed(live, first(2, 3.5, 5), fast(2, (2.9, 1)))[-1] == 4
    live.follow(None)
    assert live.plan is None
    assert live.forecast is None
    assert not live.by_plan


TURNING = """mission flight
time  step 0.5 s, horizon 2 s
world (0, 0) to (6, 6)
team drone[1] { dynamics unicycle(speed 0..2 m/s)  start at (3, 3) }
require faces: drone[0]: always[0, 2 s] heading within 30 deg of 0 deg
"""


def test_who_turns_away_is_told_at_once() -> None:
    live = session(TURNING)
    lines = [
        json.dumps({"t": time, "agent": "drone[0]", "position": [3, 3], "velocity": [0, 0], "heading": heading})
        for time, heading in ((0.0, 0.0), (0.5, 0.25), (1.0, 1.0))
    ]
    assert fed(live, lines[0])[-1] == 0
    assert fed(live, lines[1]) == [1]
    assert fed(live, lines[2]) == [(2, "faces", "violated", False, "rad", False, None), 2]


def test_all_requirements_together_stand_as_the_worst_of_them() -> None:
    live = session()
    assert live.verdict is LiveVerdict.OPEN
    fed(live, first(0, 3, 3), fast(0, (2, 1)))
    standing = live.standings[0]

    def stands(*verdicts: LiveVerdict) -> LiveVerdict:
        live.standings = tuple(replace(standing, verdict=verdict) for verdict in verdicts)
        return live.verdict

    satisfied, violated, opened = LiveVerdict.SATISFIED, LiveVerdict.VIOLATED, LiveVerdict.OPEN
    assert stands(satisfied, satisfied, satisfied, violated) is satisfied
    assert stands(satisfied, opened, violated, opened) is violated
    assert stands(satisfied, satisfied, opened, satisfied) is opened


def test_a_team_in_one_line_is_judged_at_once() -> None:
    live = session(FLIGHT)
    assert fed(live, line(0, (3, 3), (2, 1)))[-1] == 0
