"""Streams of samples that come out of order, twice or not at all, against the recorded trace judged offline."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.source import Source
from missionc.base.trace import Judgement
from missionc.base.units import Steps
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operators import by_name
from missionc.verification.monitoring.live.session import Session
from missionc.verification.monitoring.live.verdicts import LiveVerdict
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.monitoring.read_trace import read_trace
from tests.properties.verification.test_live_judge import asked, assert_final, assert_fits, slowed
from tests.support.random_runs import SPAN, formulas, leaves, mission_of


@dataclass(frozen=True)
class Stream:
    """A recorded flight within the top speed, and its samples as lines; each may come late by ``wait`` at most."""

    mission: ir.Mission
    kernel: Kernel
    judgement: Judgement
    times: list[float]
    lines: list[str]
    wait: float


@st.composite
def streams(draw: st.DrawFn) -> Stream:
    """Samples on a grid of quarters of a step, no two of an agent further apart than a step."""
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 4))
    top = draw(st.sampled_from([0.4, 3.0]))
    throughout = ir.Window(Steps(0), Steps(steps), SPAN)
    plain = st.builds(
        lambda name, leaf: ir.Apply(by_name[name], (leaf,), throughout, SPAN),
        st.sampled_from(["always", "eventually"]),
        leaves(size),
    )
    formula = draw(st.one_of(plain, formulas(size, steps, 2)))
    mission, kernel = asked(slowed(mission_of(size, steps), top), formula)
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    largest = draw(st.sampled_from([1, 2, 4]))
    rows, times, lines = ["agent,t,x,y,vx,vy"], [], []
    for agent in range(size):
        time, place, velocity = 0.0, generator.integers(0, 5, 2) / 2, np.zeros(2)
        while True:
            numbers = [float(each) for each in (*place.round(3), *velocity.round(3))]
            rows.append(",".join(map(str, (f"drone[{agent}]", time, *numbers))))
            record = {"t": time, "agent": f"drone[{agent}]", "position": numbers[:2], "velocity": numbers[2:]}
            times.append(time)
            lines.append(json.dumps(record))
            if time >= steps:
                break
            later = float(generator.integers(1, largest + 1)) / 4
            turn, speed = generator.uniform(0, 2 * np.pi), generator.choice([0.0, 0.5, 0.97]) * top
            velocity = speed * np.array([np.cos(turn), np.sin(turn)])
            time, place = time + later, place + later * velocity
    trace, findings = read_trace(Source("flown.csv", "\n".join(rows)), mission)
    assert trace is not None, findings
    (judgement,) = monitor(mission, kernel, trace).requirements
    return Stream(mission, kernel, judgement, times, lines, draw(st.sampled_from([0.0, 0.25, 1.0, 3.0])))


def judged(stream: Stream, lines: list[str]) -> Session:
    """The session at the end of the stream. A verdict for good was never another one, and is the recorded one."""
    session, said = Session(stream.mission, stream.kernel, wait=stream.wait), LiveVerdict.OPEN
    for line in [*lines, ""]:
        list(session.feed(line) if line else session.finish())
        for standing in session.standings:
            assert_fits(standing, stream.judgement)
            assert said in (LiveVerdict.OPEN, standing.verdict)
            said = standing.verdict
    return session


def delayed(stream: Stream, places: list[int], generator: np.random.Generator) -> list[str]:
    """Some of the lines, some of them twice, each late by the wait at most."""
    twice = [place for place in places for _ in range(generator.integers(1, 3))]
    arrival = np.array(stream.times)[twice] + generator.uniform(0, stream.wait, len(twice))
    return [stream.lines[twice[place]] for place in np.argsort(arrival, kind="stable")]


@given(streams(), st.integers(0, 2**32 - 1))
def test_whatever_comes_within_the_wait_is_judged_as_if_it_had_come_in_order(stream: Stream, seed: int) -> None:
    session = judged(stream, delayed(stream, list(range(len(stream.lines))), np.random.default_rng(seed)))
    assert session.over
    assert_final(session.standings[0], stream.judgement)


@settings(max_examples=60)
@given(streams(), st.integers(0, 2**32 - 1))
def test_an_agent_that_is_silent_for_longer_than_a_step_makes_no_verdict_for_good_wrong(
    stream: Stream, seed: int
) -> None:
    generator = np.random.default_rng(seed)
    of_first = stream.times.index(0.0, 1) if stream.times.count(0.0) > 1 else len(stream.times)
    last_seen = int(generator.integers(0, of_first))
    next_seen = int(generator.integers(last_seen + 1, of_first + 1))
    next_time = stream.times[next_seen] if next_seen < of_first else np.inf
    silent = range(last_seen + 1, next_seen) if next_time - stream.times[last_seen] > stream.mission.step else range(0)
    judged(stream, delayed(stream, [place for place in range(len(stream.lines)) if place not in silent], generator))


@settings(max_examples=30)
@given(streams())
def test_an_orderly_stream_is_judged_no_later_than_its_samples_pass_a_step(stream: Stream) -> None:
    session = Session(stream.mission, stream.kernel, wait=stream.wait)
    seen = dict.fromkeys(range(len(stream.mission.agents)), -1.0)
    for place in np.argsort(stream.times, kind="stable"):
        record = json.loads(stream.lines[place])
        seen[int(record["agent"][6:-1])] = record["t"]
        list(session.feed(stream.lines[place]))
        assert session.steps.closed > min(min(seen.values()), stream.mission.steps)
