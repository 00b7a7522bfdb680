"""The record of a live flight for its web page, with links and formations, and the page itself as HTML.

    in   events of a session of online monitoring, one after the other; the current plan
    out  the changes since an event, for a page that has the flight up to it: a dict that JSON can hold

Its memory does not grow with the length of the flight. Communication links and formations are given at each column,
with those that are broken or at risk now. The page has the map, the lanes and the style of the report.
"""

from __future__ import annotations

import base64
import hashlib
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace, decimals
from missionc.ir import Formation, Graph, Mission
from missionc.ir.couplings import directed
from missionc.ir.kernel.analysis import robustness_unit
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.margins.links import are_linked, link_margin
from missionc.ir.language.margins.predicate_margins import formation_margin
from missionc.ir.language.walk_formulas import goals
from missionc.output.report.pack import pack, thousandths
from missionc.output.report.render_page import SCRIPTS, asset, scripts
from missionc.output.report.requirement_lanes import HARMS, HELPS, OPEN
from missionc.output.report.world_data import world_data
from missionc.verification.monitoring.live import session
from missionc.verification.monitoring.live.samples import StepState
from missionc.verification.monitoring.live.verdicts import LiveVerdict, Standing

MOST_MEMBERS = 200
"""Maximum number of agents in a graph whose links are drawn."""

EVERY = 0.1
"""Interval of link updates, in seconds of mission time."""

INSTANT = 1e-9
"""Tolerance in seconds up to which two times count as equal."""

KEPT, AT_RISK, BROKEN = range(3)
"""States of a formation edge: satisfied, at risk, violated."""

NOWHERE = 1e6
"""Position uncertainty in metres from which an agent counts as lost and has no link."""


def drawn_graphs(mission: Mission) -> tuple[Graph, ...]:
    """Communication graphs whose links the page draws."""
    return tuple(graph for graph in mission.graphs if 1 < len(graph.agents) <= MOST_MEMBERS)


def couplings_data(mission: Mission) -> dict[str, Any]:
    """Static data on graphs and formations for the page: names, directions of links, edges by the agents' numbers."""
    return {
        "graphs": [{"name": graph.name, "directed": directed(graph)} for graph in drawn_graphs(mission)],
        "formations": [
            {"name": each.name, "edges": [[edge.first, edge.second] for edge in each.edges]}
            for each in mission.formations
        ],
    }


class Links(Record, eq=False):
    """Flags of the linked pairs of each graph at a step, (pairs,), boolean."""

    step: int
    links: Mapping[str, Flags]


class CouplingsRecord:
    """Record of the links that begin and end at each column, and of formation margins there.

    Args:
        columns: number of columns.
    """

    def __init__(self, mission: Mission, columns: int) -> None:
        self._columns = columns
        self._changes: dict[str, list[NDArray[np.int64]]] = {}
        self._written: dict[str, Flags] = {}
        self.last = Links(-1, {})
        self._margins: dict[str, Array] = {}
        self.set_world(mission)

    def set_world(self, mission: Mission) -> None:
        """Set the current mission, with the same graphs and formations but possibly other ranges.

        New ones have no past.
        """
        self.mission = mission
        for each in mission.formations:
            self._margins.setdefault(each.name, np.full((len(each.edges), self._columns), -np.inf))

    def take(self, state: StepState, column: int | None) -> None:
        """Record the team's state at a step; steps come in order.

        Args:
            column: column of the step, or None if the step has none.
        """
        known, seconds = _known(state), float(self.mission.step)
        if self.last.step < 0 or (state.step - self.last.step) * seconds > EVERY - INSTANT:
            found = {graph.name: _linked(graph, state.position, known) for graph in drawn_graphs(self.mission)}
            self.last = Links(state.step, found)
        if column is None:
            return
        for graph in drawn_graphs(self.mission):
            changes = self._changes.setdefault(graph.name, [])
            changes += [np.zeros((0, 3), dtype=np.int64)] * (column - len(changes))
            first, second = _pairs(graph)
            none = np.zeros(len(first), dtype=np.bool_)
            linked = self.last.links.get(graph.name, none)
            changed = linked ^ self._written.get(graph.name, none)
            changes.append(np.stack([first[changed], second[changed], linked[changed]], axis=1))
            self._written[graph.name] = linked
        for formation in self.mission.formations:
            self._margins[formation.name][:, column] = _edges(formation, state.position, known)

    def since(self, first: int, last: int) -> dict[str, Any]:
        """Data of the columns from ``first`` to before ``last``, as copies that do not change later."""
        changes = {
            graph.name: list(enumerate(self._changes.get(graph.name, [])[first:last], first))
            for graph in drawn_graphs(self.mission)
        }
        margins = {each.name: self._margins[each.name][:, first:last].copy() for each in self.mission.formations}
        return {"changes": changes, "margins": margins}


def packed(fresh: dict[str, Any]) -> dict[str, Any]:
    """Result of ``CouplingsRecord.since`` packed for a page; rows are column, two agents, and 1 if the link begins."""
    return {
        "changes": {name: pack(_rows(changes)) for name, changes in fresh["changes"].items()},
        "margins": {name: pack(thousandths(margins)) for name, margins in fresh["margins"].items()},
    }


def _rows(changes: list[tuple[int, NDArray[np.int64]]]) -> NDArray[np.int64]:
    whole = [np.concatenate([np.full((len(rows), 1), column), rows], axis=1) for column, rows in changes]
    return np.concatenate([np.zeros((0, 4), dtype=np.int64), *whole])


def couplings_now(mission: Mission, state: StepState, plan: Trace | None, last: Links) -> dict[str, Any]:
    """Current, endangered and broken links of each graph, as pairs of agents, and states of formation edges, for the
    page.

    A link is at risk if it will break within one step at current velocities, or if it is uncertain because an agent was
    not observed. A link is broken if the plan has it now, and the team does not.

    Args:
        last: the links of the last call.
    """
    known = _known(state)
    ahead = state.position + state.velocity * float(mission.step)
    graphs = {}
    for graph in drawn_graphs(mission):
        ends = np.stack(_pairs(graph))
        linked = last.links.get(graph.name, np.zeros(ends.shape[1], dtype=np.bool_)) & known[ends].all(axis=0)
        first, second = ends[:, linked]
        lasting = are_linked(graph, first, second, ahead[first], ahead[second])
        doubt = state.doubt[first] + state.doubt[second]
        unsure = lasting & (doubt > 0)
        one, other = first[unsure], second[unsure]
        lasting[unsure] = link_margin(graph, one, other, state.position[one], state.position[other]) > doubt[unsure]
        broken = np.zeros_like(linked)
        if plan is not None and state.step < plan.position.shape[1]:
            broken = _linked(graph, plan.position[:, state.step], np.ones_like(known)) & ~linked
        risk = np.stack([first[~lasting], second[~lasting]])
        chosen = {"linked": ends[:, linked], "risk": risk, "broken": ends[:, broken]}
        graphs[graph.name] = {name: pack(each.T) for name, each in chosen.items()}
    return {"graphs": graphs, "formations": {each.name: _standing(each, state, ahead) for each in mission.formations}}


def _known(state: StepState) -> Flags:
    """Flags of the agents with a known position, (agents,), boolean."""
    return np.asarray((state.doubt < NOWHERE) & np.isfinite(state.position).all(axis=1))


def _pairs(graph: Graph) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Agents of each pair that may be linked, sender and receiver, (pairs,) each; once if links are undirected."""
    members = np.array(graph.agents, dtype=np.int64)
    first, second = np.triu_indices(len(members), 1)
    if directed(graph):
        first, second = np.append(first, second), np.append(second, first)
    return members[first], members[second]


def _linked(graph: Graph, position: Array, known: Flags) -> Flags:
    """Flags of the linked pairs among the agents with a known position, (pairs,), boolean.

    Args:
        position: (agents, dim), metres.
    """
    first, second = _pairs(graph)
    near = known[first] & known[second]
    near[near] = are_linked(graph, first[near], second[near], position[first[near]], position[second[near]])
    return near


def _edges(formation: Formation, position: Array, known: Flags) -> Array:
    """Margins of a formation's edges, (edges,), metres; -inf for agents without a known position."""
    margins = [
        float(formation_margin(formation, edge, position[edge.first], position[edge.second]))
        if known[edge.first] and known[edge.second]
        else -np.inf
        for edge in formation.edges
    ]
    return np.array(margins)


def _standing(formation: Formation, state: StepState, ahead: Array) -> list[int]:
    known = _known(state)
    unsure = np.array([state.doubt[edge.first] + state.doubt[edge.second] for edge in formation.edges])
    margins, later = _edges(formation, state.position, known), _edges(formation, ahead, known)
    stands = np.where(margins < 0, BROKEN, np.where((margins < unsure) | (later < 0), AT_RISK, KEPT))
    return [int(each) for each in stands]


POLICY = (
    "default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content security policy of the page: it runs only its own script, and connects only to its own server."""

ASSETS = Path(__file__).resolve().parent / "assets"
OF_ONE_PLAN = frozenset(
    {"svg_canvas.js", "charts.js", "words.js", "margins.js", "plans.js", "suggestions.js", "export.js", "main.js"}
)
"""Scripts of the report about a single plan, which the page of a flight in progress omits."""
OF_REPORT = tuple(name for name in SCRIPTS if name not in OF_ONE_PLAN)
OWN = ("flight_model.js", "flight_lanes.js", "flight_status.js", "flight_main.js")
"""Scripts of the page in order, after those of the report."""


def flight_html() -> tuple[bytes, str]:
    """HTML of the page, the same for every mission, and its content security policy."""
    script = "\n".join([scripts(OF_REPORT), *map(_own, OWN)])
    parts = {"STYLE": asset("style.css") + _own("flight.css"), "SCRIPT": script}
    pieces = _own("flight.html").split("%%")
    page = "".join(parts[piece] if number % 2 else piece for number, piece in enumerate(pieces))
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    return page.encode("utf-8"), POLICY.format(digest)


def _own(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")


MOST_COLUMNS = 2000
"""Maximum number of past times that are stored; for missions with more steps, every second or third step, and so on."""

MOST_NEWS = 200

EFFECT = {LiveVerdict.SATISFIED: HELPS, LiveVerdict.VIOLATED: HARMS, LiveVerdict.OPEN: OPEN}

Tone = Literal["plain", "good", "risk", "bad"]


class News(Record):
    """Message that the page shows once; ``t`` in seconds of mission time, or None without a time."""

    number: int
    t: float | None
    tone: Tone
    says: str


class Seen(Record):
    """State of a page: the last column, message, world and plan that it has."""

    columns: int = 0
    news: int = 0
    world: int = 0
    plan: int = 0


class FlightRecord:
    """Data of a flight in progress for its page.

    A column is a time in the past: one for every ``stride`` steps. Callers must synchronize threads that read and
    write; ``since`` returns copies.
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
        self._now: session.Judged | None = None
        self._since = [0.0] * count
        self._heard: float | None = None
        self._heard_at = time.monotonic()
        self._ended = ""
        self._plan: Trace | None = None
        self._couplings = CouplingsRecord(mission, self.columns)
        self.set_world(mission, kernel)

    # ------------------------------------------------------------------ writing

    def set_world(self, mission: Mission, kernel: Kernel) -> None:
        """Set the current mission: same agents, steps and goals, possibly other regions and obstacles."""
        self.mission, self.kernel = mission, kernel
        self._couplings.set_world(mission)
        self._world = _world(mission, kernel, self.stride, self.columns)
        self._known = replace(self._known, world=self._known.world + 1, plan=self._known.plan + 1)

    def set_plan(self, trace: Trace | None) -> None:
        """Set the current plan, which the page draws as paths."""
        self._plan = trace
        self._known = replace(self._known, plan=self._known.plan + 1)

    def take(self, event: session.Event) -> None:
        """Record an event of a monitoring session."""
        seconds = float(self.mission.step)
        match event:
            case session.Judged():
                self._judged(event)
            case session.Forecast(step, name, margin, unit):
                forecast = "violated" if margin < 0 else "satisfied again"
                number = f"{decimals(margin)} {unit}".rstrip()
                says = f"{name}: forecast {forecast}, robustness {number} if all agents follow the plan"
                self.tell(says, "risk" if margin < 0 else "plain", step * seconds)
            case session.Change(step, standing, unit):
                if standing.verdict is not LiveVerdict.OPEN:
                    self._since[self._index(standing.name)] = step * seconds
                if step or standing.verdict is not LiveVerdict.OPEN or standing.at_risk:
                    self.tell(*_change(standing, unit, seconds), step * seconds)
            case session.Presence(step, missing, back):
                if missing:
                    self.tell(f"{', '.join(missing)} missing", "bad", step * seconds)
                if back:
                    self.tell(f"{', '.join(back)} received again", "plain", step * seconds)
            case session.Outrun(step, agents):
                says = f"{', '.join(agents)} above the top speed; bounds based on the top speed are withdrawn"
                self.tell(says, "bad", step * seconds)
            case session.Breach(step, constraint):
                self.tell(f"violated: {constraint.violation()}", "bad", step * seconds)
            case session.Implausible(line, agent, time):
                self.tell(f"line {line} set aside: the time of {agent}, {time:g} s, is far ahead of all others", "risk")
            case session.Unusable(line, reason):
                self.tell(f"unusable line {line}: {reason}", "plain")

    def tell(self, says: str, tone: Tone = "plain", t: float | None = None) -> None:
        """Add a message to those that the page shows."""
        self._known = replace(self._known, news=self._known.news + 1)
        self._news.append(News(self._known.news, t, tone, says))

    def hear(self, newest: float) -> None:
        """Record that a sample has arrived.

        Args:
            newest: latest time of any sample, seconds of mission time.
        """
        self._heard, self._heard_at = (newest if math.isfinite(newest) else self._heard), time.monotonic()

    def end(self, says: str) -> None:
        """Record that the flight has ended; ``says`` is the reason in words."""
        self._ended = says

    def _judged(self, judged: session.Judged) -> None:
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
        """New state of a page, and a function that returns its changes from the state ``seen`` as a dict.

        The function may run later, in any thread: it shares no data with this object.
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
"""Position uncertainty in metres from which an agent counts as lost."""


def _world(mission: Mission, kernel: Kernel, stride: int, columns: int) -> dict[str, Any]:
    """Data of the world and the goals for the page, with columns instead of steps."""
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


def _now(judged: session.Judged, since: list[float], seconds: float) -> dict[str, Any]:
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
    """Sentence about a changed verdict on a goal, and its tone."""
    match standing.verdict:
        case LiveVerdict.VIOLATED:
            most = f", robustness at most {decimals(standing.most)} {unit}".rstrip()
            return f"{standing.name}: violated (final){most if math.isfinite(standing.most) else ''}", "bad"
        case LiveVerdict.SATISFIED:
            return f"{standing.name}: satisfied (final)", "good"
        case LiveVerdict.OPEN if standing.at_risk:
            return f"{standing.name}: at risk; violated at the next step if velocities stay constant", "risk"
        case LiveVerdict.OPEN:
            return f"{standing.name}: open, decided by {standing.decided_by * seconds:g} s", "plain"


def _thousandths(values: NDArray[np.float32]) -> NDArray[np.int64]:
    return thousandths(np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=np.inf, neginf=-np.inf))


def _number(value: float) -> float | None:
    """The number for JSON, with None for infinity."""
    return value if math.isfinite(value) else None


def _dict(news: News) -> dict[str, Any]:
    return {"number": news.number, "t": news.t, "tone": news.tone, "says": news.says}
