"""The record of a flight that goes on: all that a page of it shows, in memory that the flight's length does not change.

in   events of a session of online monitoring, one after the other; the plan that is followed; what else there is to say
out  what a page has to be told that knows it up to some point: a dict that JSON can hold
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from missionc.base.figures import decimals
from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.kernel.analysis import robustness_unit
from missionc.kernel.nodes import Kernel
from missionc.language.walk_formulas import goals
from missionc.monitoring.live.session import (
    Breach,
    Change,
    Event,
    Forecast,
    Implausible,
    Judged,
    Outrun,
    Presence,
    Unusable,
)
from missionc.monitoring.live.verdicts import Standing, Verdict
from missionc.output.flight_page.couplings import CouplingsRecord, couplings_data, couplings_now, packed
from missionc.output.report.pack import pack, thousandths
from missionc.output.report.requirement_lanes import HARMS, HELPS, OPEN
from missionc.output.report.world_data import world_data

MOST_COLUMNS = 2000
"""Moments of the past that are kept: where a mission has more steps, every second one, or third, and so on."""

MOST_NEWS = 200

EFFECT = {Verdict.SATISFIED: HELPS, Verdict.VIOLATED: HARMS, Verdict.OPEN: OPEN}

Tone = Literal["plain", "good", "risk", "bad"]


@dataclass(frozen=True, slots=True)
class News:
    """Something to be told once; ``t`` in seconds of the mission, and None where it has no time."""

    number: int
    t: float | None
    tone: Tone
    says: str


@dataclass(frozen=True, slots=True)
class Seen:
    """How much a page knows already: columns, news, and which world and plan."""

    columns: int = 0
    news: int = 0
    world: int = 0
    plan: int = 0


class FlightRecord:
    """What is known of a flight by now.

    A column is a moment of the past: of every ``stride`` steps one. Who reads and who writes in different threads has
    to keep them apart; ``since`` copies what it hands out.
    """

    def __init__(self, mission: Mission, kernel: Kernel) -> None:
        self.stride = max(1, -(-int(mission.steps) // MOST_COLUMNS))
        self.columns = -(-int(mission.steps) // self.stride) + 1
        self._place = np.full((mission.dimension, len(mission.agents), self.columns), np.nan, dtype=np.float32)
        count = len(kernel.requirements) + len(kernel.preferences)
        self._bounds = np.zeros((2, count, self.columns), dtype=np.float32)
        self._effect = np.zeros((count, self.columns), dtype=np.int8)
        self._news: deque[News] = deque(maxlen=MOST_NEWS)
        self._known = Seen()
        self._now: Judged | None = None
        self._since = [0.0] * count
        self._heard: float | None = None
        self._heard_at = time.monotonic()
        self._ended = ""
        self._plan: Trace | None = None
        self._couplings = CouplingsRecord(mission, self.columns)
        self.set_world(mission, kernel)

    # ------------------------------------------------------------------ writing

    def set_world(self, mission: Mission, kernel: Kernel) -> None:
        """The world as it is now: the same agents, steps and goals, perhaps other regions and obstacles."""
        self.mission, self.kernel = mission, kernel
        self._couplings.set_world(mission)
        self._world = _world(mission, kernel, self.stride, self.columns)
        self._known = replace(self._known, world=self._known.world + 1, plan=self._known.plan + 1)

    def set_plan(self, trace: Trace | None) -> None:
        """The plan that is followed from now on: drawn as paths."""
        self._plan = trace
        self._known = replace(self._known, plan=self._known.plan + 1)

    def take(self, event: Event) -> None:
        """What a session says."""
        seconds = float(self.mission.step)
        match event:
            case Judged():
                self._judged(event)
            case Forecast(step, name, margin, unit):
                says = f"{name} is lost by the plan" if margin < 0 else f"{name} is kept by the plan again"
                number = f"{says}: {decimals(margin)} {unit}".rstrip()
                self.tell(
                    f"{number}, if everybody goes on as planned", "risk" if margin < 0 else "plain", step * seconds
                )
            case Change(step, standing, unit):
                if standing.verdict is not Verdict.OPEN:
                    self._since[self._index(standing.name)] = step * seconds
                if step or standing.verdict is not Verdict.OPEN or standing.at_risk:
                    self.tell(*_change(standing, unit, seconds), step * seconds)
            case Presence(step, missing, back):
                if missing:
                    self.tell(f"{', '.join(missing)} missing", "bad", step * seconds)
                if back:
                    self.tell(f"{', '.join(back)} seen again", "plain", step * seconds)
            case Outrun(step, agents):
                says = f"{', '.join(agents)} faster than the top speed: what rested on it is taken back"
                self.tell(says, "bad", step * seconds)
            case Breach(step, constraint):
                self.tell(f"violated: {constraint.violation()}", "bad", step * seconds)
            case Implausible(line, agent, time):
                self.tell(f"line {line} is set aside: {time:g} s of {agent} is far ahead of all others", "risk")
            case Unusable(line, reason):
                self.tell(f"line {line} cannot be used: {reason}", "plain")

    def tell(self, says: str, tone: Tone = "plain", t: float | None = None) -> None:
        """Something else that is worth a line among the news."""
        self._known = replace(self._known, news=self._known.news + 1)
        self._news.append(News(self._known.news, t, tone, says))

    def hear(self, newest: float) -> None:
        """A sample has come; ``newest`` is the latest time of any, seconds of the mission."""
        self._heard, self._heard_at = (newest if math.isfinite(newest) else self._heard), time.monotonic()

    def end(self, says: str) -> None:
        """Nothing more will come; ``says`` why, in words."""
        self._ended = says

    def _judged(self, judged: Judged) -> None:
        self._now, state, standings = judged, judged.state, judged.standings
        reached = state.step * float(self.mission.step)
        self.hear(reached if self._heard is None else max(self._heard, reached))
        self._couplings.take(state, None if state.step % self.stride else state.step // self.stride)
        if state.step % self.stride:
            return
        column = state.step // self.stride
        seen = state.position.copy()
        seen[~np.isfinite(seen).all(axis=1) | (state.doubt >= _FAR)] = np.nan
        self._place[:, :, column] = seen.T
        for index, each in enumerate(standings):
            self._bounds[:, index, column] = each.least, each.most
            self._effect[index, column] = EFFECT[each.verdict]
        self._known = replace(self._known, columns=column + 1)

    def _index(self, name: str) -> int:
        goals = (*self.kernel.requirements, *self.kernel.preferences)
        return next(index for index, goal in enumerate(goals) if goal.name == name)

    # ------------------------------------------------------------------ reading

    def since(self, seen: Seen | None) -> tuple[Seen, Callable[[], dict[str, Any]]]:
        """What a page that has ``seen`` so much does not know, and how much it knows then.

        What makes the dict out of it may be called later, and elsewhere: it shares nothing with what is written here.
        """
        known, seen = self._known, seen or Seen()
        fresh = slice(seen.columns, known.columns)
        place = self._place[:, :, fresh].copy()
        bounds, effect = self._bounds[:, :, fresh].copy(), self._effect[:, fresh].copy()
        couplings, linked = self._couplings.since(fresh.start, fresh.stop), self._couplings.last
        mission = self.mission
        told: dict[str, Any] = {"news": [_dict(each) for each in self._news if each.number > seen.news]}
        if seen.world != known.world:
            told["world"] = self._world
        now, since, plan = self._now, list(self._since), self._plan
        told["stream"] = {
            "heard": self._heard,
            "quiet": round(time.monotonic() - self._heard_at, 1),
            "ended": self._ended,
        }
        seconds = float(self.mission.step)

        def made() -> dict[str, Any]:
            if seen.plan != known.plan:
                told["plan"] = None if plan is None else pack(thousandths(np.moveaxis(plan.position, 2, 0)))
            told["columns"] = {
                "from": fresh.start,
                "count": place.shape[2],
                "place": pack(_thousandths(place)),
                "seen": pack(np.isfinite(place[0]).astype(np.int64)),
                "bounds": pack(_thousandths(bounds)),
                "effect": pack(effect),
                **packed(couplings),
            }
            if now is not None:
                told["now"] = {
                    **_now(now, since, seconds),
                    "couplings": couplings_now(mission, now.state, plan, linked),
                }
            return told

        return known, made


_FAR = 1e6
"""Metres: an agent in doubt by so much is nowhere."""


def _world(mission: Mission, kernel: Kernel, stride: int, columns: int) -> dict[str, Any]:
    """The world as a map has it, with columns in the place of steps, and the goals."""
    words = {goal.name: " ".join(goal.formula.span.text.split()) for goal in goals(mission)}
    told = [
        {
            "name": goal.name,
            "words": words.get(goal.name, ""),
            "preference": index >= len(kernel.requirements),
            "unit": robustness_unit(goal.formula),
        }
        for index, goal in enumerate((*kernel.requirements, *kernel.preferences))
    ]
    world = world_data(mission, kernel)
    return {
        **world,
        **couplings_data(mission),
        "step": world["step"] * stride,
        "steps": columns - 1,
        "every": stride,
        "lasts": float(mission.horizon),
        "goals": told,
    }


def _now(judged: Judged, since: list[float], seconds: float) -> dict[str, Any]:
    state = judged.state
    return {
        "t": state.step * seconds,
        "place": [
            None if doubt >= _FAR else list(map(float, each))
            for each, doubt in zip(state.position, state.doubt, strict=True)
        ],
        "doubt": [float(min(each, _FAR)) for each in state.doubt],
        "missing": list(state.missing),
        "goals": [
            {
                "verdict": each.verdict.value,
                "risk": each.at_risk,
                "least": _number(each.least),
                "most": _number(each.most),
                "by": each.decided_by * seconds,
                "since": when,
                "plan": _number(judged.by_plan.get(index, math.inf)),
            }
            for index, (each, when) in enumerate(zip(judged.standings, since, strict=True))
        ],
    }


def _change(standing: Standing, unit: str, seconds: float) -> tuple[str, Tone]:
    """A verdict that changed, as a sentence."""
    match standing.verdict:
        case Verdict.VIOLATED:
            least = "" if not math.isfinite(standing.most) else f"; at most {decimals(standing.most)} {unit}".rstrip()
            return f"{standing.name} is lost: violated for good{least}", "bad"
        case Verdict.SATISFIED:
            return f"{standing.name} is satisfied for good", "good"
        case Verdict.OPEN if standing.at_risk:
            return f"{standing.name} is at risk: lost a step from now, if everybody goes on like this", "risk"
        case Verdict.OPEN:
            return f"{standing.name} is open, decided by {standing.decided_by * seconds:g} s", "plain"


def _thousandths(values: NDArray[np.float32]) -> NDArray[np.int64]:
    return thousandths(np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=np.inf, neginf=-np.inf))


def _number(value: float) -> float | None:
    """JSON knows no infinity."""
    return value if math.isfinite(value) else None


def _dict(news: News) -> dict[str, Any]:
    return {"number": news.number, "t": news.t, "tone": news.tone, "says": news.says}
