"""Evaluation of a flight in a closed loop: requirements over all of it, and bodies at every moment.

    in   the mission, what happened, the paths flown
    out  Outcome

What happened is judged as it was: an agent that is lost is asked nothing from then on, and a world that has changed is
another one from then on. Whether anybody planned anew makes no difference here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from missionc.base.limits import Limits
from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.monitoring.live.judge import LiveJudge
from missionc.monitoring.live.verdicts import Verdict
from missionc.monitoring.monitor import monitor
from missionc.pipeline.checked import Checked
from missionc.pipeline.remaining import earlier
from missionc.progression.rest_of_mission import team_at
from missionc.progression.stretches import Remaining, Stretch, after
from missionc.simulate.judge_flight import at_steps, room


@dataclass(frozen=True, slots=True)
class Cut:
    """From a step on somebody is lost, and files of the mission read otherwise."""

    time: float
    lost: tuple[str, ...] = ()
    texts: Mapping[str, str] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """How a flight went.

    Args:
        requirements: by its name, whether it was kept.
        room: the least room between two bodies, or a body and an obstacle, m; negative where they touch.
        since: of each that was not kept, the first moment, s, at which nothing within the top speeds of those who are
            left could keep it.
    """

    requirements: Mapping[str, bool]
    room: float
    since: Mapping[str, float] = field(default_factory=dict)

    @property
    def satisfied(self) -> bool:
        return all(self.requirements.values())

    @property
    def untouched(self) -> bool:
        return self.room >= 0


def judge(
    checked: Checked, cuts: list[Cut], times: Array, position: Array, velocity: Array, heading: Array, limits: Limits
) -> Outcome:
    """Judge a flight.

    Args:
        checked: the whole mission as it was planned at first.
        cuts: in the order of their times.
        times: (samples,), s, from 0 to the end of the mission.
        position, velocity: (agents, samples, 3), m and m/s; heading: (agents, samples), rad.
    """
    mission, kernel = checked.mission, checked.kernel
    assert mission is not None
    assert kernel is not None
    whole = at_steps(mission, times, position, velocity, heading)
    rest, now, written = Remaining(mission, kernel), checked, mission
    rows, begin, least = list(range(len(mission.agents))), 0, math.inf
    names = [agent.name for agent in mission.agents]
    since: dict[str, float] = {}
    for cut in cuts:
        step = min(math.ceil(cut.time / mission.step - 1e-9), int(mission.steps) - 1)
        least = min(least, _room(rest.mission, written, times, position[rows], begin * mission.step, cut.time))
        if cut.texts:
            now = earlier(now, cut.texts, limits, 1.0)
            assert now.mission is not None
            written = now.mission
        _mark(since, rest, _part(whole, rows, begin, step), begin)
        rest = after(rest, Stretch(_part(whole, rows, begin, step), cut.lost), written)
        rows = [names.index(agent.name) for agent in rest.mission.agents]
        begin = step
    least = min(least, _room(rest.mission, written, times, position[rows], begin * mission.step, float(times[-1])))
    last = _part(whole, rows, begin, int(mission.steps))
    _mark(since, rest, last, begin)
    kept = {each.name: each.satisfied for each in monitor(rest.mission, rest.kernel, last).requirements}
    over = float(mission.horizon)
    return Outcome(kept, least, {name: since.get(name, over) for name, each in kept.items() if not each})


def _mark(since: dict[str, float], rest: Remaining, trace: Trace, begin: int) -> None:
    """Note since when, seconds, a requirement cannot be kept by any continuation of what was flown by then."""
    for name in rest.nobodys:
        since.setdefault(name, float(begin * trace.step))
    live = LiveJudge(rest.mission, rest.kernel)
    for step in range(trace.position.shape[1]):
        for standing in live.advance(trace.position[:, step], trace.velocity[:, step], trace.heading[:, step]):
            if standing.verdict is Verdict.VIOLATED:
                since.setdefault(standing.name, float((begin + step) * trace.step))


def _part(trace: Trace, rows: list[int], begin: int, end: int) -> Trace:
    part = slice(begin, end + 1)
    return Trace(trace.step, trace.position[rows, part], trace.velocity[rows, part], trace.heading[rows, part])


def _room(left: Mission, written: Mission, times: Array, position: Array, begin: float, end: float) -> float:
    """The least room of those that are left, from one time to another, straight from sample to sample."""
    chosen = (times >= begin - 1e-9) & (times <= end + 1e-9)
    if chosen.sum() < 2:
        return math.inf
    when, place = times[chosen], position[:, chosen]
    team = team_at(written, 0.0, place[:, 0, : left.dimension], tuple(agent.name for agent in left.agents))
    return min((check.margin for check in room(team, when, place)), default=math.inf)
