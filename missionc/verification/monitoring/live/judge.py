"""Online monitor: robustness interval of every goal after each step, over all continuations.

    in   Mission, Kernel, the team's state at consecutive steps
    out  a Standing for each goal after each step

The values of a formula are stored only while a parent reads them, and the work per step does not grow with the mission.
Final values are folded into accumulators, one for each pending step of a temporal operator.

*And*, *or* and *at least* combine values at the same step, of team formulas and of formulas for one agent. Operators
that look back know everything except future steps, and store one value for the past.

A window to the mission's end that is evaluated at every step is rewritten as a formula on the past of the last step H.
It has the same robustness at step 0 in every run, and its values need not all be stored:

``always[0, end] (a or eventually[0, end] b)`` requires at H that every step back to 0 has ``a`` or ``b``, or a ``b``
since. This is a past ``Release``, which advances from step to step. Its dual is ``since``.

``always[0, end] (a or h until[0, end] b)`` requires the same at H, and before H that ``h`` holds at every step without
a ``b`` since a step with neither ``a`` nor ``b``: there ``h``, or the past ``Release``. Both formulas are monotone and
hold in the same runs, so they have equal robustness.

Source:
    Deshmukh, Donzé, Ghosh, Jin, Juniwal, Seshia, "Robust online monitoring of signal temporal logic" (2017), with
    bounds on the future from the agents' top speeds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Flags, Indices
from missionc.ir import Mission
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import bottom_up, children, graph_of, looks_back, rebuilt, same_objects, window_of
from missionc.verification.monitoring.live.needed_steps import needed_steps, reaches_start
from missionc.verification.monitoring.live.spatial import GraphHistory, Where, lengths_in_metres, live_reach, neighbour
from missionc.verification.monitoring.live.team_state import TeamState
from missionc.verification.monitoring.live.verdicts import LiveVerdict, Standing
from missionc.verification.monitoring.live.windows import (
    LEAST,
    LEASTS,
    MOST,
    MOSTS,
    AtomBounds,
    Cells,
    Columns,
    UntilWindow,
    Window,
    cells_after,
    denied,
    of_measure,
)


class Parts:
    """Operands of one *and*, *or* or *at least*; the same formula for several agents is one entry.

    Attributes:
        bodies: formulas evaluated for agents, with these agents; ``others`` are the remaining operands.
    """

    def __init__(self, node: k.All | k.Any | k.AtLeast, columns: Mapping[k.Node, Columns]) -> None:
        self.node = node
        self.plain: list[Columns] = []
        self.at: dict[Columns, list[int]] = {}
        self.bodies: dict[k.Node, list[int]] = {}
        self.others = [part for part in node.parts if not isinstance(part, k.At) or part in columns]
        for part in node.parts:
            if isinstance(part, k.At) and part not in columns:
                self.at.setdefault(columns[part.body], []).append(part.agent)
                self.bodies.setdefault(part.body, []).append(part.agent)
            else:
                self.plain.append(columns[part])
        self.rows = max((each.rows for each in self.plain), default=1)

    def bounds(self, begin: int, count: int, cells: int) -> Array:
        """Bounds of the operator at ``count`` steps from ``begin`` on and in the future cells: (4, rows, columns),
        metres.
        """
        taken = [
            (body.part(begin, count, cells), np.array(agents) if body.rows > 1 else None, len(agents))
            for body, agents in self.at.items()
        ]
        plain = [each.part(begin, count, cells) for each in self.plain]
        shape = (4, self.rows, max(count, 0) + cells)
        if isinstance(self.node, k.AtLeast):
            each = [part[:, agent : agent + 1] for part, agents, _ in taken if agents is not None for agent in agents]
            each += [part for part, agents, number in taken if agents is None for _ in range(number)]
            return self._at_least(self.node.count, [np.broadcast_to(part, shape) for part in (*each, *plain)], shape)
        choose, found = (np.minimum, np.inf) if self.node.every else (np.maximum, -np.inf)
        result = np.full(shape, found)
        for part in plain:
            choose(result, part, out=result)
        for part, agents, _ in taken:
            chosen = part if agents is None else np.asarray(choose.reduce(part[:, agents], axis=1, keepdims=True))
            choose(result, chosen, out=result)
        return result

    def _at_least(self, count: int, parts: list[Array], shape: tuple[int, ...]) -> Array:
        if count <= 0 or count > len(parts):
            return np.full(shape, np.inf if count <= 0 else -np.inf)
        return np.asarray(np.partition(np.stack(parts), -count, axis=0)[-count])


class PastWindow:
    """Online evaluation of ``once``, ``since`` and their duals (by negation).

    Without ``hold``, the hold condition is true.

    If every window reaches back to step 0, the result of old steps is one number, ``carried``.
    """

    def __init__(
        self, node: k.WindowNode | k.UntilNode, own: Columns, hold: Columns | None, end: Columns, last: int
    ) -> None:
        self.node, self.own, self.hold, self.end, self.last = node, own, hold, end, last
        self.near, self.far = -(node.high or 0), -node.low
        self.carries = reaches_start(node, own.asked)
        self.folded = -1
        self.carried = np.full((4, own.rows, 1), -np.inf)

    def update(self, cells: Cells) -> Array:
        """Bounds of the operator at the steps that are not final, and in the future cells: (4, rows, columns),
        metres.
        """
        now, own = cells.now, self.own
        begin, known = own.begin, own.known
        if self.carries:
            self._carry(min(begin - 1 - self.near, now - self.end.asked.ahead, now - self._hold_ahead()))
        columns = [self._since(step, step - self.far, step - self.near) for step in range(begin, known + 1)]
        if len(cells) and (known == now or begin > now):
            columns.append(self._to_come(cells))
        found = np.concatenate(columns, axis=2) if columns else np.empty((4, own.rows, 0))
        return denied(found) if self.node.every else found

    def _hold_ahead(self) -> int:
        return 0 if self.hold is None else self.hold.asked.ahead

    def _carry(self, final: int) -> None:
        for step in range(self.folded + 1, min(final, self.end.known) + 1):
            value = self._of(self.end, step, step + 1)
            if self.hold is not None and self.hold.asked.first <= step <= self.hold.known:
                self.carried = np.minimum(self.carried, self._of(self.hold, step, step + 1))
            self.carried = np.maximum(self.carried, value)
            self.folded = step

    def _since(self, step: int, begin: int, end: int) -> Array:
        """Bounds of the truth that the operand ``self.end`` holds at a step from ``begin`` to ``end``, and ``hold``
        after it.

        The hold condition must hold up to ``step``.

        Shape: (4, rows, 1), metres.
        """
        first = max(begin, self.folded + 1, 0)
        if self.hold is None:
            ends = self._of(self.end, first, end + 1)
            found = ends.max(axis=2, keepdims=True, initial=-np.inf)
            found = np.maximum(found, self.carried) if self.carries and begin <= self.folded else found
            return np.asarray(found)
        first = max(first, self.hold.asked.first - 1, self.end.asked.first)
        # From the present backwards: the running value of ``hold`` after each step.
        since = self._of(self.hold, first + 1, step + 1)[:, :, ::-1]
        held = np.minimum.accumulate(np.concatenate([np.full((4, since.shape[1], 1), np.inf), since], axis=2), axis=2)
        held = held[:, :, ::-1]
        ends = self._of(self.end, first, end + 1)
        found = np.minimum(ends, held[:, :, : ends.shape[2]]).max(axis=2, keepdims=True, initial=-np.inf)
        if self.carries and begin <= self.folded:
            whole = self._of(self.hold, first, step + 1).min(axis=2, keepdims=True, initial=np.inf)
            found = np.maximum(found, np.minimum(self.carried, whole))
        return np.broadcast_to(found, (4, self.own.rows, 1))

    def _to_come(self, cells: Cells) -> Array:
        """Bounds of the operator in the future cells, from known and possible values of each window.

        Shape: (4, rows, cells), metres, widening.
        """
        now, count = cells.now, len(cells)
        ends = self._signed(self.end.to_come(count))
        holds = None if self.hold is None else self._signed(self.hold.to_come(count))
        found = np.full((4, self.own.rows, count), -np.inf)
        if self.hold is None and self.near == 0:
            # Every window reaches up to now: it contains a suffix of the known steps.
            begin = max(now - self.far, self.folded + 1, self.end.asked.first)
            whole = self._of(self.end, begin, now + 1)[:2, :, ::-1]
            so_far = np.maximum.accumulate(whole, axis=2)[[0, 1, 0, 1], :, ::-1]
            at = np.stack([cells.ends, cells.begins]) - self.far - begin
            known = [self._part(so_far, each) for each in at]
            found[LEASTS] = np.maximum(known[0], ends)[LEASTS]
            found[MOSTS] = np.maximum(known[1], ends)[MOSTS]
            return self._widening(found)
        for cell, (first, last) in enumerate(zip(cells.begins.tolist(), cells.ends.tolist(), strict=True)):
            surely = self._since(now, last - self.far, min(now, first - self.near))
            perhaps = self._since(now, first - self.far, min(now, last - self.near))
            if holds is not None:
                surely = np.minimum(surely, holds[:, :, cell : cell + 1])
                perhaps = np.minimum(perhaps, holds[:, :, :1])
            least, most = surely[:, :, 0], perhaps[:, :, 0]
            if self.near == 0:
                least = np.maximum(least, ends[:, :, cell])
            if last - self.near > now and self.end.asked.last > now:
                most = np.maximum(most, ends[:, :, int(cells.of(np.array(last - self.near)))])
            found[LEASTS, :, cell], found[MOSTS, :, cell] = least[LEASTS], most[MOSTS]
        return self._widening(found)

    def _part(self, so_far: Array, begin: Indices) -> Array:
        """Result over the known steps from each of the given columns on, including the carried value for older steps.

        Shape: (4, rows, columns), metres.
        """
        columns = so_far.shape[2]
        if not columns:
            found = np.full((4, self.own.rows, len(begin)), -np.inf)
        else:
            found = so_far[:, :, np.clip(begin, 0, columns - 1)]
            found = np.where(begin >= columns, -np.inf, found)
        return np.where(begin < 0, np.maximum(found, self.carried), found) if self.carries else found

    def _widening(self, found: Array) -> Array:
        """Widen the bounds of cells, (4, rows, cells), metres, so that they also hold for earlier cells."""
        for row in LEASTS:
            found[row] = np.minimum.accumulate(found[row], axis=1)
        for row in MOSTS:
            found[row] = np.maximum.accumulate(found[row], axis=1)
        return found

    def _signed(self, bounds: Array) -> Array:
        return denied(bounds) if self.node.every else bounds

    def _of(self, operand: Columns, begin: int, end: int) -> Array:
        """Bounds of an operand at its known steps from ``begin`` to before ``end``: (4, rows, steps), metres."""
        begin = max(begin, operand.asked.first)
        return self._signed(operand.steps(begin, max(min(end, operand.known + 1), begin)))


def looking_back(root: k.Node, last: int) -> k.Node:
    """The formula with windows to the mission's end rewritten as windows on the past; the same formula if it has none.

    Args:
        last: last step of the mission.
    """
    wholes: dict[tuple[bool, k.Node], k.Node] = {}

    def over(node: k.Node, parts: tuple[k.Node, ...]) -> k.Node:
        if isinstance(node, k.WindowNode):
            return _put_otherwise(node, last, wholes)
        return node if same_objects(parts, _asked_now(node)) else rebuilt(node, parts)

    return bottom_up((root,), over, _asked_now)[root]


def _asked_now(node: k.Node) -> tuple[k.Node, ...]:
    """Operands that are evaluated at the operator's own step."""
    return children(node) if isinstance(node, k.All | k.Any | k.AtLeast | k.At) else ()


def _put_otherwise(node: k.WindowNode, last: int, wholes: dict[tuple[bool, k.Node], k.Node]) -> k.Node:
    """The window over the complete mission, rewritten if another window to the mission's end is below it."""
    if node.low != 0 or node.high not in (None, last) or not last:
        return node
    body = node.body
    if isinstance(body, k.At):
        return k.At(body.agent, _whole(node, body.body, last, wholes), body.span)
    same, other = (k.All, k.Any) if node.every else (k.Any, k.All)
    if isinstance(body, same) and any(isinstance(part, k.At) for part in body.parts):
        return same(tuple(_whole(node, part, last, wholes) for part in body.parts), body.span)
    parts = body.parts if isinstance(body, other) else (body,)
    endless = [part for part in parts if _is_endless(part, every=not node.every)]
    if len(endless) != 1:
        return node
    (inner,) = endless
    assert isinstance(inner, k.WindowNode | k.UntilNode)
    end = inner.body if isinstance(inner, k.WindowNode) else inner.end
    others = tuple(part for part in parts if part is not inner)
    kind = k.Release if node.every else k.Until
    back = kind(end, other((*others, end), node.span), -last, 0, node.span)
    at_last = k.Always(back, last, last, node.span)
    if isinstance(inner, k.WindowNode):
        return at_last
    before = (k.Always if node.every else k.Eventually)(other((inner.hold, back), node.span), 0, last - 1, node.span)
    return same((before, at_last), node.span)


def _whole(node: k.WindowNode, part: k.Node, last: int, wholes: dict[tuple[bool, k.Node], k.Node]) -> k.Node:
    """The rewritten window over one operand; a formula for several agents gives one shared node."""
    if isinstance(part, k.At):
        return k.At(part.agent, _whole(node, part.body, last, wholes), part.span)
    key = (node.every, part)
    if key not in wholes:
        kind = k.Always if node.every else k.Eventually
        wholes[key] = _put_otherwise(kind(part, 0, node.high, node.span), last, wholes)
    return wholes[key]


def _is_endless(node: k.Node, every: bool) -> bool:
    """Return whether a node is an operator of the given kind from the present step to the mission's end."""
    return (
        isinstance(node, k.WindowNode | k.UntilNode)
        and not looks_back(node)
        and (node.low, node.high) == (0, None)
        and node.every is every
    )


COASTED_MOST = 3


class LiveJudge:
    """Online monitor of a mission, which processes the team's states step by step.

    A final verdict holds for every continuation within the agents' top speeds. If an agent moves faster, verdicts that
    relied on its speed are withdrawn: bounds then use the observed motion, and a verdict may change again.
    """

    def __init__(self, mission: Mission, kernel: k.Kernel) -> None:
        self.mission, self.last, self.agents = mission, int(mission.steps), len(mission.agents)
        self.goals = tuple(replace(goal, formula=looking_back(goal.formula, self.last)) for goal in kernel.goals)
        self.now = -1
        self.asked = needed_steps((goal.formula for goal in self.goals), self.last)
        self.columns: dict[k.Node, Columns] = {}
        self.operators: dict[k.Node, Window | UntilWindow | PastWindow | Parts] = {}
        self.histories: dict[object, GraphHistory] = {}
        dropped = _read_by_parents(self.asked) - {goal.formula for goal in self.goals}
        self.order = [node for node in self.asked if node not in dropped]
        for node in self.order:
            self._prepare(node)
        atoms = [node.predicate for node in self.order if isinstance(node, k.Atom)]
        atoms += [
            node.body.predicate for node in self.order if isinstance(node, k.Not) and isinstance(node.body, k.Atom)
        ]
        self.state = TeamState(mission, dict.fromkeys(atoms))
        self.deadlines, self.spans = self._deadlines()
        self.bounds = np.tile([-np.inf, np.inf], (len(self.goals), 1))
        self.outrun: set[int] = set()

    def copy(self) -> LiveJudge:
        """An independent monitor in the same state."""
        shared: list[object] = [self.mission, self.goals, self.asked, *self.asked, *self.asked.values()]
        shared += [*self.histories, *self.state.levels, *self.state.flags]
        return deepcopy(self, {id(each): each for each in shared})

    # ------------------------------------------------------------------ a step

    def advance(
        self, position: Array, velocity: Array, heading: Array | None = None, doubt: Array | None = None
    ) -> tuple[Standing, ...]:
        """Process the team's state at the next step, and return the standing of each goal.

        Args:
            position, velocity: (agents, dim), metres and m/s.
            heading: (agents,), rad; default 0, for missions without headings.
            doubt: (agents,), metres: maximum distance of an agent from this position; 0 if it is known.

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
        """Return whether an agent moved faster than its top speed since the last step.

        ``outrun`` collects these agents.

        Args:
            position: (agents, dim), metres.
            doubt: uncertainty of the position, (agents,), metres.
        """
        if self.now < 0:
            return False
        way = np.linalg.norm(position - self.state.position[:, 0], axis=1) - doubt - self.state.doubt
        top = np.array([agent.dynamics.top_speed for agent in self.mission.agents]) * self.mission.step
        faster = np.flatnonzero(way > top * (1 + 1e-6) + 1e-6)
        self.outrun.update(faster.tolist())
        return bool(len(faster))

    def _standing(self, number: int, goal: k.Goal, faster: bool) -> Standing:
        column = self.columns[goal.formula].steps(0, 1)[:, 0, 0]
        least, most, coasted = float(column[LEAST]), float(column[MOST]), float(column[COASTED_MOST])
        if not faster and (self.now < self.last or self.state.doubt.any()):
            least, most = max(least, self.bounds[number, 0]), min(most, self.bounds[number, 1])
        self.bounds[number] = least, most
        verdict = LiveVerdict.SATISFIED if least > 0 else LiveVerdict.VIOLATED if most < 0 else LiveVerdict.OPEN
        is_open = verdict is LiveVerdict.OPEN
        by = self._decided_by(goal.formula, 0) if is_open else self.now
        return Standing(goal.name, verdict, of_measure(least), of_measure(most), is_open and coasted < 0, by)

    def _decided_by(self, node: k.Node, row: int) -> int:
        """Latest step at which a formula, evaluated at a single step, is decided.

        Args:
            row: the agent for which the formula is evaluated.
        """
        asked = self.asked[node]
        latest = min(asked.first + asked.ahead, self.last)
        if not asked.once or not isinstance(node, k.All | k.Any | k.At):
            return latest
        if isinstance(node, k.At):
            return self._decided_by(node.body, node.agent)
        operator = self.operators[node]
        assert isinstance(operator, Parts)
        opened = [self._decided_by(part, row) for part in operator.others if not self._is_decided(part, row)]
        for body, agents in operator.bodies.items():
            left = self._open_rows(body)[agents]
            if left.any() and isinstance(body, k.All | k.Any | k.At):
                opened += [self._decided_by(body, agents[number]) for number in np.flatnonzero(left)]
            elif left.any():
                opened.append(self._decided_by(body, 0))
        return min(latest, max(opened, default=self.now))

    def _open_rows(self, node: k.Node) -> Flags:
        """Flags of the agents for which a formula is undecided: (agents,), boolean."""
        first, columns = self.asked[node].first, self.columns[node]
        if not self.asked[node].once or first > self.now:
            return np.ones(self.agents, dtype=np.bool_)
        bounds = columns.steps(first, first + 1)[:, :, 0]
        return np.broadcast_to((bounds[LEAST] <= 0) & (bounds[MOST] >= 0), (self.agents,))

    def _is_decided(self, node: k.Node, row: int) -> bool:
        if isinstance(node, k.At):
            return self._is_decided(node.body, node.agent)
        return not self._open_rows(node)[row]

    # --------------------------------------------------------------- formulas

    def _prepare(self, node: k.Node) -> None:
        """Allocate the storage for a formula's bounds, and the accumulators for its operands."""
        below = [self.columns[each] for each in children(node) if each in self.columns]
        rows = max((each.rows for each in below), default=1)
        asked = self.asked[node]
        match node.body if isinstance(node, k.Not) else node:
            case k.Atom(predicate):
                rows = 1 if predicate.about_team else self.agents
            case k.Is():
                rows = self.agents
            case k.At():
                rows = 1
            case k.NeighbourNode() | k.ReachNode() | k.RouteNode() | k.PathLength():
                rows = self.agents
            case k.All() | k.Any() | k.AtLeast():
                assert isinstance(node, k.All | k.Any | k.AtLeast)
                parts = Parts(node, self.columns)
                rows, self.operators[node] = parts.rows, parts
            case _:
                pass
        own = self.columns[node] = Columns(asked, rows)
        match node:
            case k.WindowNode(body) if looks_back(node):
                self.operators[node] = PastWindow(node, own, None, self.columns[body], self.last)
            case k.UntilNode(hold, end) if looks_back(node):
                self.operators[node] = PastWindow(node, own, self.columns[hold], self.columns[end], self.last)
            case k.WindowNode(body):
                self.operators[node] = Window(node, own, self.columns[body], self.last)
            case k.UntilNode(hold, end):
                self.operators[node] = UntilWindow(node, own, self.columns[hold], self.columns[end], self.last)
            case _:
                pass
        graph = graph_of(node.body if isinstance(node, k.Not) else node)
        if graph is not None:
            history = self.histories.setdefault(graph, GraphHistory(graph, 0))
            history.kept = max(history.kept, asked.ahead)

    def _evaluate(self, node: k.Node, atoms: AtomBounds, cells: Cells) -> None:
        """Compute a formula's bounds, from its children, at the steps that are not final and in the future cells."""
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

    def _value(self, node: k.Node, below: list[Array], where: Where, atoms: AtomBounds) -> Array:
        match node:
            case k.Not(k.PathLength() as body):
                return lengths_in_metres(body, False, self.histories[body.graph], (), where, self.agents)
            case k.Not(body):
                return denied(self._leaf(body, where, atoms))
            case k.Atom() | k.Is():
                return self._leaf(node, where, atoms)
            case k.At(agent):
                return below[0] if below[0].shape[1] == 1 else below[0][:, agent : agent + 1]
            case k.NeighbourNode(graph):
                return neighbour(node, self.histories[graph], below[0], where, self.agents)
            case k.ReachNode(graph):
                return live_reach(node, self.histories[graph], below[0], below[1], where, self.agents)
            case k.RouteNode(graph):
                return lengths_in_metres(node, True, self.histories[graph], tuple(below), where, self.agents)
            case k.PathLength(graph):
                return lengths_in_metres(node, True, self.histories[graph], (), where, self.agents)
            case _:
                raise AssertionError(node)

    def _leaf(self, node: k.Node, where: Where, atoms: AtomBounds) -> Array:
        """Bounds of a formula without operands, (4, rows, columns), metres; its value at a step is final at once."""
        match node:
            case k.Atom(predicate):
                bounds = atoms.of_predicate(predicate)
                return bounds[:, :, 0 if where.count else 1 : 1 + where.cells]
            case k.Is(agents):
                fact = np.array([np.inf if agent in agents else -np.inf for agent in range(self.agents)])
                return np.broadcast_to(fact[None, :, None], (4, self.agents, where.columns))
            case _:
                raise AssertionError("a kernel in negation normal form negates its leaves alone")

    def _deadlines(self) -> tuple[list[int], list[int]]:
        """Last steps of windows that are evaluated at one step, and look-aheads of the other windows, in steps."""
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


def _read_by_parents(nodes: Iterable[k.Node]) -> set[k.Node]:
    """Formulas without their own storage: read only by *and*, *or* and *at least* for agents, and negated leaves."""
    alone: dict[k.Node, bool] = {}
    for node in nodes:
        for child in children(node):
            reads = isinstance(node, k.Not) or (isinstance(child, k.At) and isinstance(node, k.All | k.Any | k.AtLeast))
            alone[child] = alone.get(child, True) and reads
    return {node for node, reads in alone.items() if reads}
