"""Single-agent search: shortest path that satisfies one agent's formulas, around the reservations.

    in   formulas about one agent, reservations of agents planned before
    out  shortest path on its time-expanded roadmap that satisfies them, or nothing

It searches the product of the time-expanded roadmap and the automaton of residuals (``progression``), step by step.
States beyond a cost bound (``distance_to_go``) are pruned; the bound grows until there is a path. The result is the
shortest path. Conditions on planned agents are evaluated on their trajectories.

Source:
    Hart, Nilsson and Raphael, 1968: f = g + h; here all nodes of a step are expanded together.

Routes in metres beside planned agents: states of one agent in which formulas over them are true.

Planned agents follow their trajectories, and all others are far away. The monitor's own functions evaluate the
formulas, so that nothing is rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from missionc.backends.smt.encode.clauses import TRUE, Clauses
from missionc.backends.smt.encode.lower import Formulas, deep
from missionc.backends.smt.encode.lower_motion import Occupancy, lower_motion
from missionc.backends.smt.prioritized.label_setting import Mover, OwnMemory, Signature, Sweep, Task, letters_of
from missionc.backends.smt.prioritized.reservations import Exclusion, Reservations, may_be
from missionc.backends.smt.roadmap.labels import Labels, Unexpressible, own_states, states_of
from missionc.backends.smt.settings import smt_settings
from missionc.base.trace import Array, Flags, Indices, Trace
from missionc.ir.kernel.analysis import helped_by_more, reads_lengths, steps_ahead
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Node, Not
from missionc.ir.kernel.walk import children, postorder, window_of
from missionc.ir.language.margins.predicate_margins import holds, of_pair
from missionc.planning.distance_to_go import DistanceToGo
from missionc.planning.progression.residuals import (
    Progression,
    Relaxation,
    Residual,
    TooComplex,
)
from missionc.verification.monitoring.monitor import truths


def is_measured(node: Node) -> bool:
    """Return true if the formula or a subformula reads lengths in metres."""
    return any(map(reads_lengths, postorder((node,))))


def holds_beside(node: Node, agent: int, reservations: Reservations, labels: Labels, may: Flags) -> Flags:
    """Steps and states of the agent, within ``may``, in which the formula is true: (steps + 1, states).

    Raises:
        TooComplex: the formula is about other steps, or names agents that are not planned.
    """
    away = 1e12  # metres to agents without a path, and between them; no link is that long
    present = {agent, *reservations.agents}
    for part in postorder((node,)):
        unknown = isinstance(part, At) and part.agent not in present
        unknown |= isinstance(part, Atom) and not labels.of_places(part.predicate)
        if unknown:
            raise TooComplex
    if steps_ahead((node,))[node]:
        raise TooComplex
    mission, motion = labels.mission, reservations.motion
    step, state = np.nonzero(may)
    position = np.full((motion.agents, len(step), mission.dimension), away)
    position[:, :, 0] *= np.arange(1, motion.agents + 1)[:, None]
    for other in reservations.agents:
        position[other] = motion.roadmap(other).position[reservations.states[other]][step]
    position[agent] = motion.roadmap(agent).position[state]
    trace = Trace(mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))
    found = np.zeros(may.shape, dtype=np.bool_)
    found[step, state] = truths((node,), mission, trace)[node][agent]
    return found


Settled = set[tuple[int, bytes]]
"""Planned agents with their paths."""


class SingleAgentSearch:
    """Search for shortest paths of single agents around the planned agents of ``reservations``.

    Args:
        never: forbidden states of some agents, (steps + 1, states).
        limit: maximum number of clauses.
        haste: cost of a step, as a fraction of the longest move; 0 counts only metres, None means the setting.
        exclusions: exclusions that restrict an agent near planned agents.
    """

    def __init__(
        self,
        labels: Labels,
        never: dict[int, Flags],
        reservations: Reservations,
        limit: int,
        haste: float | None = None,
        exclusions: Sequence[Exclusion] = (),
    ) -> None:
        haste = smt_settings(labels.mission).search.haste if haste is None else haste
        self._labels, self._never, self._limit, self._haste = labels, never, limit, haste
        self._exclusions = exclusions
        self._nobody = reservations.emptied()
        self._to_go = [
            DistanceToGo(table.roadmap.moves, table.length + haste * table.longest, len(table.roadmap.position))
            for table in reservations.tables
        ]
        self._own: set[Node] = set()
        self._monotone: dict[Node, bool] = {}
        self._known: tuple[Settled, Formulas] | None = None
        self.work = 0
        """Number of moves expanded so far."""
        self.most = math.inf
        """Number of expanded moves after which a search ends without a path."""

    def way(
        self, agent: int, formulas: Sequence[Node], reservations: Reservations, *, most: float = np.inf
    ) -> Indices | None:
        """Shortest path, states (steps + 1,), without conflict with planned agents.

        The result is None if no such path has a cost of at most ``most``, or if the search cannot express the formulas.
        """
        with deep(), suppress(TooComplex):
            return self._shortest(self.mover(agent, formulas, reservations), agent, reservations, most=most)
        return None

    def way_or_push(
        self, agent: int, formulas: Sequence[Node], reservations: Reservations, *, may_push: bool
    ) -> Indices | None:
        """Shortest path, states (steps + 1,), if necessary with conflicts with displaceable agents; None without a
        path.

        A conflict-free path is not considered if its detour costs more than a displacement. Assumptions between agents
        are checked when all are planned.
        """
        way = self._way_or_push(agent, formulas, reservations, may_push)
        if way is None and self._known is not None and self._known[0] != reservations.settled:
            self._known = None
            way = self._way_or_push(agent, formulas, reservations, may_push)
        return way

    def _way_or_push(
        self, agent: int, formulas: Sequence[Node], reservations: Reservations, may_push: bool
    ) -> Indices | None:
        push = (
            smt_settings(self._labels.mission).search.push * reservations.tables[self._labels.roadmap_of[agent]].longest
            if may_push
            else np.inf
        )
        way = None
        with deep(), suppress(TooComplex):
            mover = self.mover(agent, formulas, reservations)
            with suppress(TooComplex):
                way = self._shortest(mover, agent, reservations, more=push)
            if way is None and may_push:
                way = self._shortest(mover, agent, reservations, pushing=True)
        return way

    def with_bystanders(self, reservations: Reservations, everyone: Iterable[int]) -> Reservations | int:
        """Reservations of all agents, unplanned agents on shortest paths; or the first agent without a path."""
        whole = reservations.copy()
        for agent in sorted(set(everyone).difference(whole.agents)):
            way = self.way(agent, (), whole)
            if way is None:
                return agent
            whole.reserve((agent,), np.broadcast_to(way, whole.states.shape))
        return whole

    def alone(self, agent: int, formulas: Sequence[Node], *, shortest: bool = True) -> Indices | None:
        """Shortest path, states (steps + 1,), without other agents; None if the agent's roadmap certainly contains
        none.

        Args:
            shortest: False if any path suffices.

        Raises:
            TooComplex: the formulas concern other agents, or the search takes too much work.
        """
        with deep():
            return self._shortest(self.mover(agent, formulas, None), agent, self._nobody, any_way=not shortest)

    def metres(self, agent: int, way: Indices) -> float:
        """Length of a path of the agent, states (steps + 1,), metres."""
        table = self._nobody.tables[self._labels.roadmap_of[agent]]
        return table.metres(way)

    # ------------------------------------------------------------------- task

    def mover(self, agent: int, formulas: Sequence[Node], reservations: Reservations | None) -> Mover:
        """Agent with its task from the formulas; without reservations nothing is known about other agents.

        Raises:
            TooComplex: the search cannot express the formulas.
        """
        around = reservations or self._nobody
        table = around.tables[self._labels.roadmap_of[agent]]
        may = self._may(agent, around)
        starts = table.roadmap.starts[table.roadmap.agents.index(agent)]
        starts = starts[may[0, starts]]
        task = self._task(agent, formulas, around, may, starts, alone=reservations is None)
        return Mover(task, table, may, starts)

    def _task(
        self,
        agent: int,
        formulas: Sequence[Node],
        reservations: Reservations,
        may: Flags,
        starts: Indices,
        *,
        alone: bool,
    ) -> Task:
        """Task of the agent from the formulas, within the allowed states ``may``, (steps + 1, states)."""
        order = postorder(formulas)
        if not self._monotone.keys() >= set(order):
            self._monotone.update(helped_by_more(order))
            self._own |= own_states(order, self._labels)
        number = self._labels.roadmap_of[agent]
        table = reservations.tables[number]
        of_state: dict[Node, Flags] = {}
        of_step: dict[Node, Flags] = {}
        of_move: dict[Node, tuple[Flags, Flags]] = {}
        waiting, past = list(formulas), list[Node]()
        met: set[Node] = set()
        while waiting:
            node = waiting.pop()
            if node in met:
                continue
            met.add(node)
            leaf = node.body if isinstance(node, Not) else node
            if node in self._own:
                of_state[node] = states_of(node, agent, self._labels)
            elif isinstance(leaf, Atom) and leaf.predicate.reads_past:
                past.append(node)
            elif isinstance(leaf, Atom) and not leaf.predicate.others and self._labels.of_moves(leaf.predicate, number):
                labels, truth = self._labels, leaf is node
                begins, ends = (labels.moves(leaf.predicate, number, truth, at_end=end) for end in (False, True))
                of_move[node] = begins, ends
            elif (
                isinstance(node, All | Any | AtLeast)
                or window_of(node) is not None
                or (isinstance(node, At) and node.agent == agent)
            ):
                waiting.extend(children(node))
            elif alone:
                raise TooComplex
            else:
                of_step[node] = self._beside(node, agent, reservations, may)
        rank = {node: index for index, node in enumerate((*of_state, *of_step, *of_move, *past))}
        memory = OwnMemory(past, agent, self._labels, table.roadmap, exact=alone) if past else None
        steps, states = len(table.roadmap.standing), len(table.roadmap.position)
        places, place_letters = letters_of(list(of_state.values()), states)
        own_places, own_letters = places, place_letters
        if of_step:
            rows = [np.broadcast_to(row, (steps, states)).ravel() for row in (*of_state.values(), *of_step.values())]
            flat, place_letters = letters_of(rows, steps * states)
            places = flat.reshape(steps, states)
        both = [np.concatenate(pair) for pair in of_move.values()]
        moves, move_letters = letters_of(both, 2 * len(table.roadmap.moves))
        progression = Progression(agent, rank.get, steps - 1)
        relaxation = Relaxation(agent, lambda node: rank[node] if node in of_state else None, steps - 1)
        signature = Signature({node: row.tobytes() for node, row in of_state.items()}).of
        to_go = self._to_go[number]
        finish = np.zeros(states, dtype=np.bool_)
        finish[table.roadmap.finishes[table.roadmap.agents.index(agent)]] = True
        finish &= may[-1]

        half = len(table.roadmap.moves)
        begin = progression.begin(formulas)

        def bound(residual: Residual) -> Array:
            near = starts if residual == begin else None
            return to_go.of(relaxation.of(residual), relaxation, own_places, own_letters, signature, finish, near)

        return Task(
            progression,
            begin,
            places,
            place_letters,
            moves[:half],
            moves[half:],
            move_letters,
            finish,
            own_places,
            own_letters,
            relaxation,
            bound,
            memory,
        )

    def _beside(self, node: Node, agent: int, reservations: Reservations, may: Flags) -> Flags:
        """Return true for each step and state in which a condition on other agents is certainly true: (steps + 1,
        states)."""
        changed = 0.2  # share of changed agents from which a monotone formula is evaluated again
        leaf = node.body if isinstance(node, Not) else node
        labels, motion = self._labels, reservations.motion
        shape = reservations.tables[labels.roadmap_of[agent]].roadmap.standing.shape
        if isinstance(leaf, Atom) and leaf.predicate.others:
            others = sorted(leaf.predicate.others - {agent})
            if len(others) != 1 or others[0] not in reservations.agents:
                raise TooComplex
            theirs = motion.roadmap(others[0]).position[reservations.states[others[0]]]
            try:
                margins = of_pair(
                    leaf.predicate,
                    labels.mission,
                    agent,
                    others[0],
                    motion.roadmap(agent).position[None],
                    theirs[:, None],
                )
            except ValueError as error:
                raise TooComplex from error
            return np.broadcast_to(np.asarray(holds(leaf.predicate, np.asarray(margins))) == (leaf is node), shape)
        if is_measured(node):
            return holds_beside(node, agent, reservations, labels, may)
        known = self._formulas(reservations, changed=changed if self._monotone[node] else 0.0)
        if not known.places.decides(node):
            raise TooComplex
        step, state = np.nonzero(may)
        found = np.zeros(shape, dtype=np.bool_)
        try:
            place = state + motion.places_of(agent).start
            found[step, state] = known.places.standing(node, agent, step, place) == TRUE
        except Unexpressible as error:
            raise TooComplex from error
        return found

    def _formulas(self, reservations: Reservations, changed: float) -> Formulas:
        """Encoded formulas for the planned agents, or for an earlier set of planned agents that differs by at most the
        fraction ``changed``."""
        agents, settled = reservations.agents, reservations.settled
        if self._known is None or len(self._known[0] ^ settled) > changed * len(agents):
            motion, clauses = reservations.motion, Clauses(self._limit)  # known facts need none
            ways = reservations.fixed(motion.ways)
            known = replace(lower_motion(motion.roadmaps, ways, frozenset(agents), clauses), links=motion.links)
            formulas = Formulas(
                Labels(self._labels.mission, known.roadmaps),
                known,
                clauses,
                Occupancy(known, clauses),
                smt_settings(self._labels.mission).solver.links,
            )
            self._known = settled, formulas
        return self._known[1]

    def _may(self, agent: int, reservations: Reservations) -> Flags:
        """Allowed states of the agent, (steps + 1, states), given forbidden states and exclusions."""
        standing = reservations.tables[self._labels.roadmap_of[agent]].roadmap.standing
        may = standing & ~self._never[agent] if agent in self._never else standing
        return may_be(self._exclusions, agent, reservations, may)

    def admits(self, agents: Iterable[int], states: Indices, reservations: Reservations) -> bool:
        """Return true if the exclusions admit the joint ``states``, (agents of the mission, steps + 1), of agents.

        Args:
            reservations: reservations of all others.
        """
        whole = reservations.copy()
        whole.reserve(agents, states)
        steps = np.arange(states.shape[1])
        return all(bool(self._may(agent, whole)[steps, states[agent]].all()) for agent in agents)

    # ----------------------------------------------------------------- search

    def _shortest(
        self,
        mover: Mover,
        agent: int,
        reservations: Reservations,
        *,
        pushing: bool = False,
        most: float = np.inf,
        more: float = np.inf,
        any_way: bool = False,
    ) -> Indices | None:
        """Cheapest path, states (steps + 1,), with a cost of at most ``most``, and at most ``more`` above the lower
        bound; None without such a path.

        With ``any_way``, the path need not be the cheapest.

        Raises:
            TooComplex: the search takes too much work.
        """
        settings = smt_settings(mover.table.mission).search
        # Bounds on the cost of a path that displaces others: one push, and these multiples of the excess; then none.
        pushed = (0.5, 1.5, 3.0, 6.0, 12.0)
        task, table, starts = mover.task, mover.table, mover.starts
        least = max(float(task.bound(task.begin)[starts].min(initial=np.inf)), float(table.to_come[0]))
        most = min(most, least + more)
        if not np.isfinite(least) or most < least:
            return None
        rest = self._haste * table.longest
        sweep = Sweep(
            task,
            table,
            mover.may,
            starts,
            step_cost=0.0 if pushing else rest,  # an agent that pushes may also arrive late
            stride=table.longest + rest,
            rest=rest,
            pushing=pushing,
            in_the_way=reservations.passed(agent),
            most=min(settings.work, self.most - self.work),
        )
        excess, push = max(settings.slack * least, table.longest), settings.push * table.longest
        if any_way or len(table.length) * len(table.roadmap.allowed) <= settings.unbounded:
            bounds = []
        elif pushing:
            bounds = [push + excess * wider for wider in pushed]
        else:
            wider = 1 if np.isfinite(more) else settings.bounds
            bounds = [
                settings.exact * table.longest,
                *(excess * settings.widening**attempt for attempt in range(wider)),
            ]
        try:
            for bound in (min(most, least + excess) for excess in (*bounds, np.inf)):
                way = sweep.within(bound)
                if way is not None or bound == most:
                    break
        finally:
            self.work += sweep.work
        return way
