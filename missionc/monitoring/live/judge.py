"""Online monitor: the robustness interval of every goal after each step, over all continuations within top speeds.

in   Mission, Kernel, the team's state at one step after the other
out  a Standing for each goal after each step

A formula's values are kept only while one above it still reads them, and a step's work does not grow with the
mission: what is final is folded into accumulators, one for each step that an operator of time still waits for.

Source:
    Deshmukh, Donzé, Ghosh, Jin, Juniwal, Seshia, "Robust online monitoring of signal temporal logic" (2017), with
    bounds on what is to come from the agents' top speeds.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.ir import Mission
from missionc.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    Goal,
    Is,
    Kernel,
    NeighbourNode,
    Node,
    Not,
    PathLength,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import children, graph_of, looks_back, window_of
from missionc.monitoring.live.asked_steps import asked_steps
from missionc.monitoring.live.atom_bounds import AtomBounds
from missionc.monitoring.live.bounds import LEAST, MOST, denied, of_measure
from missionc.monitoring.live.columns import Columns
from missionc.monitoring.live.endless_windows import looking_back
from missionc.monitoring.live.horizon_cells import Cells, cells_after
from missionc.monitoring.live.past_windows import PastWindow
from missionc.monitoring.live.pointwise import Parts
from missionc.monitoring.live.spatial import GraphHistory, Where, lengths_in_metres, neighbour, reach
from missionc.monitoring.live.team_state import TeamState
from missionc.monitoring.live.verdicts import Standing, Verdict
from missionc.monitoring.live.windows import UntilWindow, Window

COASTED_MOST = 3


class LiveJudge:
    """A mission judged as its steps come.

    A verdict for good holds for every continuation in which agents keep to their top speeds. One that has moved
    faster gives up what rested on that: bounds are then those of what was seen, and a verdict may change once more.
    """

    def __init__(self, mission: Mission, kernel: Kernel) -> None:
        self.mission, self.last, self.agents = mission, int(mission.steps), len(mission.agents)
        self.goals = tuple(replace(goal, formula=looking_back(goal.formula, self.last)) for goal in kernel.goals)
        self.now = -1
        self.asked = asked_steps((goal.formula for goal in self.goals), self.last)
        self.columns: dict[Node, Columns] = {}
        self.operators: dict[Node, Window | UntilWindow | PastWindow | Parts] = {}
        self.histories: dict[object, GraphHistory] = {}
        dropped = _read_by_parents(self.asked) - {goal.formula for goal in self.goals}
        self.order = [node for node in self.asked if node not in dropped]
        for node in self.order:
            self._prepare(node)
        atoms = [node.predicate for node in self.order if isinstance(node, Atom)]
        atoms += [node.body.predicate for node in self.order if isinstance(node, Not) and isinstance(node.body, Atom)]
        self.state = TeamState(mission, dict.fromkeys(atoms))
        self.deadlines, self.spans = self._deadlines()
        self.bounds = np.tile([-np.inf, np.inf], (len(self.goals), 1))
        self.outrun: set[int] = set()

    def copy(self) -> LiveJudge:
        """Return another judge in the same state, which continues independently."""
        shared: list[object] = [self.mission, self.goals, self.asked, *self.asked, *self.asked.values()]
        shared += [*self.histories, *self.state.levels, *self.state.flags]
        return deepcopy(self, {id(each): each for each in shared})

    # ------------------------------------------------------------------ a step

    def advance(
        self, position: Array, velocity: Array, heading: Array | None = None, doubt: Array | None = None
    ) -> tuple[Standing, ...]:
        """Take in the team's state at the next step, and say how each goal stands.

        Args:
            position: (agents, dim), metres; ``velocity`` likewise, m/s.
            heading: (agents,), rad; by default 0, for missions that do not ask for headings.
            doubt: (agents,), metres: how far an agent may be from there, where its state is not known; 0 where it is.

        Raises:
            ValueError: the mission is over.
        """
        if self.now >= self.last:
            raise ValueError(f"the mission has {self.last + 1} steps, and all were seen")
        zeros = np.zeros(self.agents)
        doubt = zeros if doubt is None else doubt
        faster = self._outrun(position, doubt)
        self.now += 1
        self.state.move(position, velocity, zeros if heading is None else heading, doubt)
        cells = cells_after(self.now, self.last, self.deadlines, self.spans)
        atoms = AtomBounds(self.state, cells)
        for history in self.histories.values():
            history.extend(atoms)
        for node in self.order:
            asked = self.asked[node]
            if self.now <= asked.last + asked.ahead or self.now == self.last:
                self._evaluate(node, atoms, cells)
        return tuple(self._standing(number, goal, faster) for number, goal in enumerate(self.goals))

    def _outrun(self, position: Array, doubt: Array) -> bool:
        """Whether an agent has got further in this step than its top speed lets it; ``outrun`` says who ever has."""
        if self.now < 0:
            return False
        way = np.linalg.norm(position - self.state.position[:, 0], axis=1) - doubt - self.state.doubt
        top = np.array([agent.dynamics.top_speed for agent in self.mission.agents]) * self.mission.step
        faster = np.flatnonzero(way > top * (1 + 1e-6) + 1e-6)
        self.outrun.update(faster.tolist())
        return bool(len(faster))

    def _standing(self, number: int, goal: Goal, faster: bool) -> Standing:
        column = self.columns[goal.formula].steps(0, 1)[:, 0, 0]
        least, most, coasted = float(column[LEAST]), float(column[MOST]), float(column[COASTED_MOST])
        if not faster and (self.now < self.last or self.state.doubt.any()):
            least, most = max(least, self.bounds[number, 0]), min(most, self.bounds[number, 1])
        self.bounds[number] = least, most
        verdict = Verdict.SATISFIED if least > 0 else Verdict.VIOLATED if most < 0 else Verdict.OPEN
        is_open = verdict is Verdict.OPEN
        by = self._decided_by(goal.formula, 0) if is_open else self.now
        return Standing(goal.name, verdict, of_measure(least), of_measure(most), is_open and coasted < 0, by)

    def _decided_by(self, node: Node, row: int) -> int:
        """The step by which a formula that is asked at one step is decided at the latest."""
        asked = self.asked[node]
        latest = min(asked.first + asked.ahead, self.last)
        if not asked.once or not isinstance(node, All | Any | At):
            return latest
        if isinstance(node, At):
            return self._decided_by(node.body, node.agent)
        operator = self.operators[node]
        assert isinstance(operator, Parts)
        opened = [self._decided_by(part, row) for part in operator.others if not self._is_decided(part, row)]
        for body, agents in operator.bodies.items():
            left = self._open_rows(body)[agents]
            if left.any() and isinstance(body, All | Any | At):
                opened += [self._decided_by(body, agents[number]) for number in np.flatnonzero(left)]
            elif left.any():
                opened.append(self._decided_by(body, 0))
        return min(latest, max(opened, default=self.now))

    def _open_rows(self, node: Node) -> Flags:
        """The agents at which a formula is not decided: (agents,)."""
        first, columns = self.asked[node].first, self.columns[node]
        if not self.asked[node].once or first > self.now:
            return np.ones(self.agents, dtype=np.bool_)
        bounds = columns.steps(first, first + 1)[:, :, 0]
        return np.broadcast_to((bounds[LEAST] <= 0) & (bounds[MOST] >= 0), (self.agents,))

    def _is_decided(self, node: Node, row: int) -> bool:
        if isinstance(node, At):
            return self._is_decided(node.body, node.agent)
        return not self._open_rows(node)[row]

    # --------------------------------------------------------------- formulas

    def _prepare(self, node: Node) -> None:
        """The columns of a formula, and what folds its operands."""
        below = [self.columns[each] for each in children(node) if each in self.columns]
        rows = max((each.rows for each in below), default=1)
        asked = self.asked[node]
        match node.body if isinstance(node, Not) else node:
            case Atom(predicate):
                rows = 1 if predicate.about_team else self.agents
            case Is():
                rows = self.agents
            case At():
                rows = 1
            case NeighbourNode() | ReachNode() | RouteNode() | PathLength():
                rows = self.agents
            case All() | Any() | AtLeast():
                assert isinstance(node, All | Any | AtLeast)
                parts = Parts(node, self.columns)
                rows, self.operators[node] = parts.rows, parts
            case _:
                pass
        own = self.columns[node] = Columns(asked, rows)
        match node:
            case WindowNode(body) if looks_back(node):
                self.operators[node] = PastWindow(node, own, None, self.columns[body], self.last)
            case UntilNode(hold, end) if looks_back(node):
                self.operators[node] = PastWindow(node, own, self.columns[hold], self.columns[end], self.last)
            case WindowNode(body):
                self.operators[node] = Window(node, own, self.columns[body], self.last)
            case UntilNode(hold, end):
                self.operators[node] = UntilWindow(node, own, self.columns[hold], self.columns[end], self.last)
            case _:
                pass
        graph = graph_of(node.body if isinstance(node, Not) else node)
        if graph is not None:
            history = self.histories.setdefault(graph, GraphHistory(graph, 0))
            history.kept = max(history.kept, asked.ahead)

    def _evaluate(self, node: Node, atoms: AtomBounds, cells: Cells) -> None:
        """The bounds of a formula where they are not final, and in the cells to come, from those below it."""
        own = self.columns[node]
        own.open(self.now, len(cells))
        begin, count = own.begin, max(own.known - own.begin + 1, 0)
        to_come = len(cells) if own.asked.last > self.now else 0
        if not count and not to_come:
            return
        where = Where(count, self.now - own.known, to_come)
        operator = self.operators.get(node)
        if isinstance(operator, Parts):
            found = operator.bounds(begin, count, to_come)
        elif operator is not None:
            found = operator.update(cells)
        else:
            below = [self.columns[each].part(begin, count, to_come) for each in children(node) if each in self.columns]
            found = self._value(node, below, where, atoms)
        own.part(begin, count, to_come)[:] = found[:, :, : where.columns]

    def _value(self, node: Node, below: list[Array], where: Where, atoms: AtomBounds) -> Array:
        match node:
            case Not(PathLength() as body):
                return lengths_in_metres(body, False, self.histories[body.graph], (), where, self.agents)
            case Not(body):
                return denied(self._leaf(body, where, atoms))
            case Atom() | Is():
                return self._leaf(node, where, atoms)
            case At(agent):
                return below[0] if below[0].shape[1] == 1 else below[0][:, agent : agent + 1]
            case NeighbourNode(graph):
                return neighbour(node, self.histories[graph], below[0], where, self.agents)
            case ReachNode(graph):
                return reach(node, self.histories[graph], below[0], below[1], where, self.agents)
            case RouteNode(graph):
                return lengths_in_metres(node, True, self.histories[graph], tuple(below), where, self.agents)
            case PathLength(graph):
                return lengths_in_metres(node, True, self.histories[graph], (), where, self.agents)
            case _:
                raise AssertionError(node)

    def _leaf(self, node: Node, where: Where, atoms: AtomBounds) -> Array:
        """A leaf is final at once: its columns are the present step, where that is asked, and the cells."""
        match node:
            case Atom(predicate):
                bounds = atoms.of_predicate(predicate)
                return bounds[:, :, 0 if where.count else 1 : 1 + where.cells]
            case Is(agents):
                fact = np.array([np.inf if agent in agents else -np.inf for agent in range(self.agents)])
                return np.broadcast_to(fact[None, :, None], (4, self.agents, where.columns))
            case _:
                raise AssertionError("a kernel in negation normal form negates its leaves alone")

    def _deadlines(self) -> tuple[list[int], list[int]]:
        """The steps at which windows end that are asked at one step, and how far ahead those of the others do."""
        deadlines, spans = [], []
        for node, asked in self.asked.items():
            window = window_of(node)
            if window is None or looks_back(node):
                continue
            ends = [window[0], *([] if window[1] is None else [window[1]])]
            if asked.once:
                deadlines += [asked.first + end for end in ends]
            else:
                spans += ends
        return sorted(set(deadlines)), sorted(set(spans))


def _read_by_parents(nodes: Iterable[Node]) -> set[Node]:
    """Formulas without columns of their own: agents of whom *and*, *or* and *at least* alone ask, and denied leaves."""
    alone: dict[Node, bool] = {}
    for node in nodes:
        for child in children(node):
            reads = isinstance(node, Not) or (isinstance(child, At) and isinstance(node, All | Any | AtLeast))
            alone[child] = alone.get(child, True) and reads
    return {node for node, reads in alone.items() if reads}
