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
from missionc.monitoring.live.first_violations import first_violations
from missionc.monitoring.monitor import monitor
from missionc.pipeline.checked import Checked
from missionc.pipeline.remaining import earlier
from missionc.progression.rest_of_mission import team_at
from missionc.progression.stretches import Remaining, Stretch, after
from missionc.simulate.judge_flight import at_steps, room
from missionc.verify.certificate import Check


@dataclass(frozen=True, slots=True)
class Cut:
    """From a step on somebody is lost, and files of the mission read otherwise."""

    time: float
    lost: tuple[str, ...] = ()
    texts: Mapping[str, str] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Epoch:
    """From a time on, s, the mission reads so, and these of the team are left."""

    time: float
    mission: Mission
    team: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """How a flight went.

    Args:
        requirements: by its name, whether it was kept.
        nearest: where two bodies, or a body and an obstacle, came nearest; None where there were not two.
        epochs: the first from 0 on, one more for each cut.
        since: of each that was not kept, the first moment, s, at which nothing within the top speeds of those who are
            left could keep it.
    """

    requirements: Mapping[str, bool]
    nearest: Check | None
    epochs: tuple[Epoch, ...]
    since: Mapping[str, float] = field(default_factory=dict)

    @property
    def room(self) -> float:
        """The least room between two bodies, or a body and an obstacle, m; negative where they touch."""
        return math.inf if self.nearest is None else self.nearest.margin

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
    mission, kernel = checked.valid_mission, checked.valid_kernel
    whole = at_steps(mission, times, position, velocity, heading)
    rest, now, written = Remaining(mission, kernel), checked, mission
    rows, begin = list(range(len(mission.agents))), 0
    names = [agent.name for agent in mission.agents]
    epochs = [Epoch(0.0, mission, tuple(names))]
    flown: list[tuple[Remaining, Trace, int]] = []
    for cut in cuts:
        step = min(math.ceil(cut.time / mission.step - 1e-9), int(mission.steps) - 1)
        if cut.texts:
            now = earlier(now, cut.texts, limits)
            written = now.valid_mission
        part = whole.part(rows, begin, step)
        flown.append((rest, part, begin))
        rest = after(rest, Stretch(part, cut.lost), written)
        rows = [names.index(agent.name) for agent in rest.mission.agents]
        begin = step
        epochs.append(Epoch(cut.time, written, tuple(names[row] for row in rows)))
    last = whole.part(rows, begin, int(mission.steps))
    flown.append((rest, last, begin))
    kept = {each.name: each.satisfied for each in monitor(rest.mission, rest.kernel, last).requirements}
    lost = {name: float(mission.horizon) for name, each in kept.items() if not each}
    for stretch in reversed(flown if lost else []):
        lost |= {name: when for name, when in _since(*stretch).items() if name in lost}
    ends = [*(each.time for each in epochs[1:]), float(times[-1])]
    rooms = [
        check for each, end in zip(epochs, ends, strict=True) for check in _rooms(each, names, times, position, end)
    ]
    nearest = min(rooms, key=lambda check: check.margin, default=None)
    return Outcome(kept, nearest, tuple(epochs), lost)


def _since(rest: Remaining, trace: Trace, begin: int) -> dict[str, float]:
    """Since when, seconds, a requirement cannot be kept by any continuation of what was flown by then."""
    steps = first_violations(rest.mission, rest.kernel, trace) | dict.fromkeys(rest.nobodys, 0)
    return {name: float((begin + step) * trace.step) for name, step in steps.items()}


def _rooms(epoch: Epoch, names: list[str], times: Array, position: Array, end: float) -> list[Check]:
    """The rooms of those that are left, as long as an epoch lasts, straight from sample to sample."""
    chosen = (times >= epoch.time - 1e-9) & (times <= end + 1e-9)
    if chosen.sum() < 2:
        return []
    when, place = times[chosen], position[[names.index(name) for name in epoch.team]][:, chosen]
    team = team_at(epoch.mission, 0.0, place[:, 0, : epoch.mission.dimension], epoch.team)
    return list(room(team, when, place))
