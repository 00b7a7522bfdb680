"""Samples become states at the steps, whatever becomes of them on their way; so does a stream on the command line."""

from __future__ import annotations

import io
import json
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from missionc.base.diagnostics.code import IMPLAUSIBLE_TIME, UNUSABLE_SAMPLE
from missionc.cli.app import main
from missionc.verification.monitoring.live.samples import Fate, Sample, SampleSteps, StepState
from tests.support.random_runs import mission_of

SMALL = """mission small
time  step 1 s, horizon 4 s
world (0, 0) to (6, 6)
region goal = box (4, 4) to (5.5, 5.5)
team drone[2] {
  dynamics single_integrator(speed <= 2 m/s)
  start    line (1, 1) to (2, 1)
}
require there: drone[0]: eventually[0, 4 s] goal
require apart: always[0, 4 s] distance(drone[0], drone[1]) >= 0.5
"""


def steps_of(*samples: tuple[int, float, float], wait: float | None = None, **skew: float) -> list[StepState]:
    """The steps that samples close on a mission of two agents and 3 steps: agent, seconds, x."""
    return list(closed(SampleSteps(mission_of(2, 3), wait, {0: skew.get("first", 0.0)}), samples))


def closed(steps: SampleSteps, samples: tuple[tuple[int, float, float], ...]) -> Iterator[StepState]:
    for agent, time, x in samples:
        yield from steps.add(Sample(agent, time, (x, 0.0)))


def test_between_two_samples_an_agent_moves_straight() -> None:
    states = steps_of((0, 0.0, 0.0), (1, 0.0, 5.0), (0, 0.75, 3.0), (1, 1.0, 5.0), (0, 1.25, 5.0))
    assert [state.step for state in states] == [0, 1]
    assert states[1].position[:, 0].tolist() == [4.0, 5.0]
    assert states[1].velocity[:, 0].tolist() == [4.0, 0.0]
    assert states[1].missing == ()


def test_a_step_waits_for_everybody_and_then_no_longer() -> None:
    begun = ((0, 0.0, 0.0), (1, 0.0, 5.0))
    assert len(steps_of(*begun, (0, 1.0, 0.0), (0, 2.0, 0.0))) == 1
    states = steps_of(*begun, (0, 1.0, 0.0), (0, 2.0, 0.0), (0, 2.5, 0.0))
    assert [state.missing for state in states] == [(), (1,)]
    assert states[1].doubt.tolist() == [0.0, 10.0]
    assert len(steps_of(*begun, (0, 1.0, 0.0), (0, 2.0, 0.0), (0, 2.5, 0.0), wait=2.0)) == 1


def test_late_doubled_and_reordered_samples_are_counted() -> None:
    steps = SampleSteps(mission_of(2, 3))
    samples = ((0, 0.0, 0.0), (1, 0.0, 5.0), (0, 1.2, 1.2), (0, 0.8, 0.8), (0, 0.8, 9.0), (1, 1.0, 5.0), (1, -0.5, 9.0))
    states = list(closed(steps, samples))
    assert states[1].position[0, 0] == pytest.approx(1.0)
    assert steps.fates == {Fate.LATE: 1, Fate.DOUBLED: 1, Fate.REORDERED: 1}


def test_a_skewed_clock_is_put_right() -> None:
    states = steps_of((0, 0.25, 7.0), (1, 0.0, 5.0), first=0.25)
    assert states[0].position[:, 0].tolist() == [7.0, 5.0]


def test_an_agent_that_is_seen_after_a_gap_was_missing() -> None:
    states = steps_of((0, 0.0, 0.0), (1, 0.0, 5.0), (1, 1.0, 5.0), (0, 1.6, 4.0))
    assert states[1].missing == (0,)
    assert states[1].position[0, 0] == 4.0
    assert states[1].doubt[0] == pytest.approx(6.0)


def test_a_sample_far_ahead_waits_until_another_one_confirms_it() -> None:
    steps = SampleSteps(mission_of(2, 30))
    assert steps.leap == 10.0
    list(closed(steps, ((0, 0.0, 0.0), (1, 0.0, 5.0), (0, 20.0, 1.0))))
    assert (steps.closed, steps.fates[Fate.AHEAD]) == (1, 1)
    list(closed(steps, ((0, 20.0, 1.0), (0, 1.0, 0.0), (1, 1.0, 5.0))))
    assert steps.closed == 2
    list(closed(steps, ((1, 19.0, 5.0),)))
    assert (steps.closed, steps.fates[Fate.AHEAD]) == (20, 0)


def test_a_leap_is_a_step_at_least() -> None:
    steps = SampleSteps(mission_of(2, 30), leap=0.0)
    list(closed(steps, ((0, 0.0, 0.0), (1, 0.0, 5.0), (0, 1.0, 0.0), (1, 1.0, 5.0))))
    assert (steps.closed, steps.fates) == (2, {})


def test_a_sample_far_ahead_is_let_in_when_the_others_have_come_there() -> None:
    steps = SampleSteps(mission_of(2, 30))
    list(closed(steps, ((0, 0.0, 0.0), (1, 0.0, 5.0), (0, 14.0, 1.0))))
    list(closed(steps, ((0, 5.0, 0.0), (1, 5.0, 5.0))))
    assert (steps.closed, steps.fates[Fate.AHEAD]) == (6, 1)
    states = list(closed(steps, ((1, 14.0, 5.0),)))
    assert steps.fates == {Fate.AHEAD: 0}
    assert states[-1].step == 14
    assert states[-1].missing == ()


def test_no_more_samples_are_held_than_came_within_the_wait() -> None:
    steps = SampleSteps(mission_of(2, 1000))
    for number in range(4000):
        for _ in steps.add(Sample(0, number / 4, (0.0, 0.0))):
            pass
    assert max(len(track.times) for track in steps.tracks) <= 4 * (1 + 1 + 1) + 2  # the wait, two steps, two ends


def live(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: list[object], *words: str) -> int:
    mission = tmp_path / "small.mission"
    mission.write_text(SMALL, encoding="utf-8")
    text = "".join(line if isinstance(line, str) else json.dumps(line) + "\n" for line in lines)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    return main(["monitor", str(mission), "--live", *words])


def still(*times: float) -> list[object]:
    return [{"t": time, "agents": {"drone[0]": [1, 1], "drone[1]": [2, 1]}} for time in times]


def test_a_deadline_that_cannot_be_met_is_told_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert live(tmp_path, monkeypatch, still(0, 1, 2, 3, 4)) == 3
    said = capsys.readouterr().out
    assert "1.00 s  there  at risk" in said
    assert "2.00 s  there  violated (final)" in said
    assert "4.00 s  apart  satisfied (final)  robustness 0.500 m" in said
    assert "small: violated after 5 of 5 steps" in said


def test_a_stream_that_ends_early_leaves_open_what_is_not_decided(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert live(tmp_path, monkeypatch, still(0, 1), "--format", "json") == 4
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert records[-1]["summary"]["verdict"] == "not decided"
    assert [each["verdict"] for each in records[-1]["summary"]["requirements"]] == ["open", "open"]
    assert {"t", "step", "goal", "least", "most", "decided_by"} <= records[0].keys()


def test_a_line_that_cannot_be_used_is_told_and_skipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = ["no\n", "[]\n", {"t": 1}, {"t": 0, "agent": "scout", "position": [1, 1]}, "\n"]
    strange += [{"t": 0, "agent": "drone[0]", "position": [1]}, {"t": 0, "agent": "drone[0]", "position": [1, 1e300]}]
    strange += [{"t": "0", "agent": "drone[0]", "position": [1, 1]}, {"t": 0, "agents": [1]}]
    live(tmp_path, monkeypatch, [*strange, *still(0)])
    streams = capsys.readouterr()
    assert streams.err.count(f"warning[{UNUSABLE_SAMPLE.name}]: line ") == len(strange) - 1
    assert "there  open" in streams.out
    assert "note: 8 lines could not be used" in streams.out


def test_one_time_far_ahead_closes_no_step_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = {"t": 3600, "agent": "drone[0]", "position": [1, 1]}
    live(tmp_path, monkeypatch, [*still(0), wrong, *still(1)])
    streams = capsys.readouterr()
    assert f"warning[{IMPLAUSIBLE_TIME.name}]: line 2: the time of `drone[0]`, 3600 s, is far ahead" in streams.err
    assert "not decided after 2 of 5 steps" in streams.out
    assert "note: 1 sample dropped: too far ahead in time" in streams.out
    live(tmp_path, monkeypatch, [*still(0), wrong, *still(1)], "--leap", "1e6")
    assert "after 5 of 5 steps" in capsys.readouterr().out


def test_a_port_that_is_taken_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        assert live(tmp_path, monkeypatch, [], "--udp", str(taken.getsockname()[1]), "--format", "json") == 1  # MC718


@pytest.mark.parametrize("place", [f"{'a' * 80}:5", "nö..x:5"])
def test_a_name_that_no_host_has_is_said(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert live(tmp_path, monkeypatch, [], "--udp", place) == 1


@pytest.mark.parametrize(
    "words", [("trace.csv",), ("--continuous",), ("--udp", "x"), ("--skew", "scout=1"), ("--skew", "drone[0]=x")]
)
def test_what_does_not_go_with_live_is_refused(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert live(tmp_path, monkeypatch, [], *words) == 2


WAY = ((1, 1), (2.3, 2.3), (3.6, 3.6), (4.5, 4.5), (3.5, 3.5))
PLANNED = "agent,t,x,y\n" + "".join(f"drone[0],{t},{x},{y}\ndrone[1],{t},2,1\n" for t, (x, y) in enumerate(WAY))
"""The first drone is at the goal at 3 s, and leaves it."""


def flown(*places: tuple[float, float]) -> list[object]:
    return [{"t": t, "agents": {"drone[0]": place, "drone[1]": [2, 1]}} for t, place in enumerate(places)]


def test_what_the_plan_would_lose_is_told_before_it_is_lost_for_good(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = tmp_path / "plan.csv"
    plan.write_text(PLANNED)
    assert live(tmp_path, monkeypatch, flown(*WAY[:3], (3.9, 3.9)), "--plan", str(plan)) == 4
    said = capsys.readouterr().out
    assert "0.00 s  there  open  robustness -4.243 to 3.757 m, by the plan 0.500 m, final by 4 s" in said
    assert "3.00 s  there  the plan violates it  robustness -0.141 m" in said
    assert "violated (final)" not in said


def test_forecasts_are_in_the_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = tmp_path / "plan.csv"
    plan.write_text(PLANNED)
    live(tmp_path, monkeypatch, flown((1, 1), (1, 1)), "--plan", str(plan), "--format", "json")
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert records[0]["by_plan"] == 0.5
    assert [each["by_plan"] for each in records[-1]["summary"]["requirements"]] == [0.5, 0.5]


@pytest.mark.parametrize(("content", "code"), [("{}", "MC704"), (PLANNED.replace("drone[1]", "scout"), "MC705")])
def test_a_plan_that_is_none_of_the_mission_is_said(
    content: str, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "plan.json").write_text(content)
    assert live(tmp_path, monkeypatch, [], "--plan", str(tmp_path)) == 1
    assert f"error[{code}]" in capsys.readouterr().err


def test_positions_are_as_far_in_doubt_as_the_agent_may_have_got() -> None:
    for state in steps_of((0, 0.5, 1.0), (1, 0.0, 5.0), (1, 1.5, 5.0)):
        assert state.missing == (0,)
        assert np.array_equal(state.doubt, [5.0, 0.0])
