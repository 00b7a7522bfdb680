"""What was flown so far: until when, who was where then, holes of logs, and those who are lost."""

from __future__ import annotations

import json

import pytest

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.verification.monitoring.read_trace import FlownSoFar, State, _until, read_flown
from tests.support.legal_plans import mission_of

MISSION = mission_of([(0, 0), (9, 9)], 8, step=0.5)
"""Two agents, for 4 s."""
ALWAYS = [0.5 * step for step in range(5)]


def read(*rows: tuple[str, float, float], lost: tuple[str, ...] = ()) -> tuple[FlownSoFar | None, list[Diagnostic]]:
    """Rows of an agent, a time and its x."""
    names = {"a": "drone[0]", "b": "drone[1]"}
    text = "agent,t,x,y\n" + "".join(f"{names.get(agent, agent)},{time!r},{x!r},1\n" for agent, time, x in rows)
    return read_flown(Source("flown.csv", text), MISSION, [names[each] for each in lost])


def flown(*rows: tuple[str, float, float], lost: tuple[str, ...] = ()) -> FlownSoFar:
    found, findings = read(*rows, lost=lost)
    assert found is not None, findings
    return found


def going(agent: str, *times: float) -> list[tuple[str, float, float]]:
    """An agent at 1 m/s along x."""
    return [(agent, time, time) for time in times]


def line_of(finding: Diagnostic) -> int:
    assert finding.primary is not None
    return finding.primary.span.source.place(finding.primary.span.start)[0]


def test_it_ends_where_the_first_agent_was_seen_last_and_everybody_is_between_its_samples_then() -> None:
    found = flown(*going("a", 0.0, 0.5, 1.0, 1.5, 2.0), *going("b", 1.3, 0.9, 0.0, 0.45))
    assert found.until == 1.3
    assert found.trace.position[:, :, 0].tolist() == [[0.0, 0.5, 1.0], [0.0, 0.5, 1.0]]
    assert found.last.tolist() == [[1.3, 1.0], [1.3, 1.0]]
    assert found.seen.tolist() == [1.3, 1.3]


@pytest.mark.parametrize(("until", "steps"), [(1.0, 2), (0.9999998, 2), (0.9999, 1), (0.5, 1), (0.3, 0)])
def test_a_step_is_over_where_a_sample_is_on_time(until: float, steps: int) -> None:
    found = flown(*going("a", *ALWAYS), *going("b", *[time for time in ALWAYS if time < until], until))
    assert found.trace.position.shape == (2, steps + 1, 2)


@pytest.mark.parametrize(("end", "over"), [(4.5, True), (4.0, True), (3.9999995, True), (3.99999, False)])
def test_nothing_is_left_of_a_mission_at_its_end_alone(end: float, over: bool) -> None:
    times = [0.5 * step for step in range(8)]
    found, findings = read(*going("b", *times, end), *going("a", *times, end))
    assert (found is None) is over
    messages = [(each.message, line_of(each)) for each in findings]
    assert messages == ([("the mission ended at 4 s; no time is left to plan", 19)] if over else [])


def test_who_is_lost_neither_ends_what_was_flown_nor_the_mission() -> None:
    times = [0.5 * step for step in range(9)]
    found = flown(*going("a", 0.0, 0.5, 0.7), *going("b", *ALWAYS), lost=("a",))
    assert (found.until, found.seen.tolist()) == (2.0, [0.7, 2.0])
    assert found.trace.position[0, :, 0].tolist() == [0.0, 0.5, 0.7, 0.7, 0.7]
    found = flown(*going("a", *times), *going("b", 0.0, 0.5), lost=("a",))
    assert (found.until, found.seen.tolist(), found.last[0].tolist()) == (0.5, [0.5, 0.5], [0.5, 1.0])
    _, findings = read(*going("a", 0.0, 0.5), *going("b", *times), lost=("a",))
    assert [line_of(each) for each in findings] == [12]
    gone = flown(*going("a", 0.0, 0.5), *going("b", 0.0, 0.2), lost=("a", "b"))
    assert (gone.until, gone.trace.position[:, -1, 0].tolist()) == (4.0, [0.5, 0.2])


def test_who_is_lost_stays_where_it_was_seen_last_step_by_step() -> None:
    samples = [State("a", time, {"x": time}, MISSION.span) for time in (0.0, 0.25, 0.75, 1.0, 2.75)]
    kept = _until(samples, 2.0, True, 0.5)
    assert [(state.time, state.numbers["x"]) for state in kept] == [
        *((time, time) for time in (0.0, 0.25, 0.75, 1.0)),
        (1.5, 1.0),
        (2.0, 1.0),
    ]
    assert [state.time for state in _until(samples, 1.75, True, 0.5)] == [0.0, 0.25, 0.75, 1.0, 1.5, 1.75]
    assert _until(samples, 2.0, False, 0.5) == samples[:4]
    assert _until(samples[:4], 1.0 + 5e-7, True, 0.5) == samples[:4]
    assert _until([], 2.0, True, 0.5) == []


@pytest.mark.parametrize(
    ("times", "reason"),
    [
        ([0.0, 0.5, 1.5], ""),
        ([0.0, 0.3, 1.3], ""),
        ([0.0, 0.4, 1.41], "has no samples from 0.4 s to 1.41 s, longer than a step"),
        ([1.0, 1.5], ""),
        ([1.01, 1.5], "has its first sample at 1.01 s; the mission begins at 0 s"),
        ([0.0, 0.5, 0.5000004, 1.0], ""),
    ],
)
def test_up_to_a_second_unseen_is_gone_straight_over(times: list[float], reason: str) -> None:
    found, findings = read(*going("a", *times), *going("b", *ALWAYS[:4]))
    assert [each.message for each in findings] == ([f"`drone[0]` {reason}"] if reason else [])
    if found is not None:
        first = times[0]
        expected = [
            max(0.5 * step, first) if step or not first else first for step in range(found.trace.position.shape[1])
        ]
        assert found.trace.position[0, :, 0].tolist() == pytest.approx(expected)


def test_of_two_places_at_a_time_the_first_one_counts() -> None:
    found = flown(("a", 0.0, 0.0), ("a", 0.5, 3.0), ("a", 0.5, 4.0), ("a", 1.0, 5.0), *going("b", *ALWAYS[:3]))
    assert found.trace.position[0, :, 0].tolist() == [0.0, 3.0, 5.0]


def test_who_is_none_of_the_mission_or_never_seen_is_named() -> None:
    _, findings = read(*going("a", *ALWAYS), *going("b", *ALWAYS), *going("c", *ALWAYS))
    assert [each.message for each in findings] == ["the mission has no agent `c`"]
    _, findings = read(*going("a", *ALWAYS))
    assert [each.message for each in findings] == ["no samples of `drone[1]`"]
    _, findings = read(("a", 0.0, float("nan")))
    assert [each.message for each in findings] == ["`nan` is not a finite number"]


def test_a_hole_is_filled_with_what_both_of_its_ends_say() -> None:
    own = {
        "position": [[0.0, 1.0], [0.0, 1.0], [3.0, 4.0]],
        "velocity": [[1.0, 0.0], [2.0, 1.0], [4.0]],
        "yaw": [0.1, 0.2, 0.3],
    }
    text = json.dumps({"times": [0.0, 0.5, 1.25], "agents": [{"name": f"drone[{each}]", **own} for each in (0, 1)]})
    found, findings = read_flown(Source("flown.json", text), MISSION, ())
    assert found is not None, findings
    assert found.trace.position[1].tolist() == [[0.0, 1.0], [0.0, 1.0], pytest.approx([2.0, 3.0])]
    assert found.trace.velocity[1].tolist() == [[0.0, 0.0], pytest.approx([4.0, 4.0]), pytest.approx([4.0, 4.0])]
    assert found.trace.heading[1].tolist() == [0.1, 0.2, 0.2]
    assert found.last[1].tolist() == pytest.approx([3.0, 4.0])
