"""Encoding of motion along time-expanded roadmaps: a variable for each agent, step and possible state.

    in   roadmaps
    out  Motion: one variable for each agent, step and possible state

A state is possible only if some start leads to it in exactly that many moves, and it leads to a finish in the remaining
moves. Agents with equal roadmap, starts and finishes get the same clauses with other variables.

Source:
    [strel] Encoding Timeless PRMs using SMT Constraints, here with one variable for each state.

Occupancy literals: some agent, or no agent, in a roadmap state.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import field
from functools import cache
from typing import overload

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, NOTHING, TRUE, Clauses, Literals
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.roadmap.roadmap_links import Links, links_between
from missionc.base.late_dataclass import Record
from missionc.base.memory import reserve
from missionc.base.trace import Array, Flags, Indices
from missionc.ir import Graph


class Motion(Record, eq=False):
    """Variables for the agents' states on their roadmaps.

    A *place* is the number of a state when the states of all roadmaps are counted consecutively.

    Args:
        roadmap_of: for each agent, (agents,), the index of its roadmap.
        first_place: for each roadmap, the place of its first state; one more entry for the end.
        ways: for each agent, (steps + 1, states): True if the state is possible.
        states: for each agent, (steps + 1, states): literal that the agent is in the state; FALSE if impossible, and
            for all states of agents that are not encoded.
        links: links between places for each graph rule used; other motions of the same roadmaps may share them.
    """

    roadmaps: tuple[Roadmap, ...]
    roadmap_of: Indices
    first_place: Indices
    ways: Sequence[Flags]
    states: tuple[Literals, ...]
    links: dict[Hashable, Links] = field(default_factory=dict)

    @property
    def agents(self) -> int:
        return len(self.states)

    @property
    def steps(self) -> int:
        """Number of the last step."""
        return len(self.states[0]) - 1

    @property
    def places(self) -> int:
        return int(self.first_place[-1])

    @property
    def position(self) -> Array:
        """Positions of the states of all roadmaps: (places, dim), metres."""
        return np.concatenate([roadmap.position for roadmap in self.roadmaps])

    def places_of(self, agent: int) -> slice:
        """Places (numbers of the states) of the agent's roadmap."""
        number = self.roadmap_of[agent]
        return slice(int(self.first_place[number]), int(self.first_place[number + 1]))

    def roadmap(self, agent: int) -> Roadmap:
        return self.roadmaps[int(self.roadmap_of[agent])]

    @property
    def own_roadmaps(self) -> tuple[Roadmap, ...]:
        """Roadmap of each agent."""
        return tuple(map(self.roadmap, range(self.agents)))

    def linked(self, graph: Graph) -> Links:
        """Links of a graph between the states of all roadmaps."""
        if graph.rule not in self.links:
            self.links[graph.rule] = links_between(graph, self.position)
        return self.links[graph.rule]


def lower_motion(
    roadmaps: tuple[Roadmap, ...], ways: Sequence[Flags], cast: frozenset[int], clauses: Clauses
) -> Motion:
    """Encode that each agent is in exactly one state at each step, and moves along its roadmap; return the variables.

    Args:
        ways: possible states of each agent, (steps + 1, states), from ``all_ways``, or fewer.
        cast: agents to encode.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    states: list[Literals] = [np.zeros((0, 0), dtype=np.int32)] * len(ways)
    roadmap_of = np.zeros(len(ways), dtype=np.int64)
    for number, roadmap in enumerate(roadmaps):
        roadmap_of[list(roadmap.agents)] = number
        for agent in roadmap.agents:  # one number in memory for any shape
            states[agent] = np.broadcast_to(np.int32(FALSE), roadmap.standing.shape)
        templates: dict[bytes, tuple[Clauses, Literals]] = {}
        for agent in sorted(cast.intersection(roadmap.agents)):
            kind = ways[agent].tobytes()
            if kind not in templates:
                templates[kind] = _template(roadmap, ways[agent], clauses.limit)
            template, literals = templates[kind]
            offset = clauses.variables - 1
            clauses.fresh(template.variables - 1)
            clauses.add_shifted(template, offset)
            states[agent] = np.where(literals > 1, literals + np.int32(offset), literals).astype(np.int32)
    first_place = np.cumsum([0, *(len(roadmap.position) for roadmap in roadmaps)])
    return Motion(roadmaps, roadmap_of, first_place, ways, tuple(states))


class Ways(Sequence[Flags]):
    """Possible states of each agent, (steps + 1, states), computed on demand.

    Args:
        never: additional forbidden states of some agents, (steps + 1, states).
    """

    def __init__(self, roadmaps: tuple[Roadmap, ...], never: dict[int, Flags]) -> None:
        self._roadmaps, self._never = roadmaps, never
        self._place = {
            agent: (number, member)
            for number, roadmap in enumerate(roadmaps)
            for member, agent in enumerate(roadmap.agents)
        }
        self._of_kind: dict[tuple[int, bytes, bytes, bytes], Flags] = {}
        self._of_agent: dict[int, Flags] = {}

    def __len__(self) -> int:
        return len(self._place)

    @overload
    def __getitem__(self, agent: int) -> Flags: ...
    @overload
    def __getitem__(self, agent: slice) -> tuple[Flags, ...]: ...
    def __getitem__(self, agent: int | slice) -> Flags | tuple[Flags, ...]:
        if isinstance(agent, slice):
            return tuple(self[each] for each in range(*agent.indices(len(self))))
        if agent not in self._of_agent:
            if not 0 <= agent < len(self):
                raise IndexError(agent)
            number, member = self._place[agent]
            roadmap, never = self._roadmaps[number], self._never.get(agent)
            start, finish = roadmap.starts[member], roadmap.finishes[member]
            kind = (number, start.tobytes(), finish.tobytes(), b"" if never is None else never.tobytes())
            if kind not in self._of_kind:
                standing = roadmap.standing if never is None else roadmap.standing & ~never
                self._of_kind[kind] = _ways(roadmap, standing, start, finish)
            self._of_agent[agent] = self._of_kind[kind]
        return self._of_agent[agent]


def all_ways(roadmaps: tuple[Roadmap, ...], never: dict[int, Flags]) -> tuple[Flags, ...]:
    """Possible states of all agents, (steps + 1, states) each, computed at once."""
    return tuple(Ways(roadmaps, never))


def _ways(roadmap: Roadmap, standing: Flags, start: Indices, finish: Indices) -> Flags:
    """Return true for each state at each step that is on some motion from a start to a finish: (steps + 1, states)."""
    source, target = roadmap.moves[:, 0], roadmap.moves[:, 1]
    into = np.argsort(target, kind="stable")
    ways: Flags = np.zeros(standing.shape, dtype=np.bool_)
    ways[0, start] = True
    ways[0] &= standing[0]
    for step, allowed in enumerate(roadmap.allowed):
        ways[step + 1] = _grouped(ways[step, source[into]] & allowed[into], target[into], len(roadmap.position))
        ways[step + 1] &= standing[step + 1]
    last = np.zeros(len(roadmap.position), dtype=np.bool_)
    last[finish] = True
    ways[-1] &= last
    for step in range(len(roadmap.allowed) - 1, -1, -1):
        ways[step] &= _grouped(ways[step + 1, target] & roadmap.allowed[step], source, len(roadmap.position))
    return ways


def _grouped(flags: Flags, owner: Indices, count: int) -> Flags:
    """Return true for each owner that has some flag set: (count,)."""
    return np.bincount(owner[flags], minlength=count) > 0


def _template(roadmap: Roadmap, ways: Flags, limit: int) -> tuple[Clauses, Literals]:
    """Clauses of one agent's motion, and its literals, (steps + 1, states)."""
    move_bytes = 100  # approximate memory of one move at one step while it becomes clauses
    clauses = Clauses(limit)
    literals = np.full(ways.shape, FALSE, dtype=np.int32)
    choices = ways.sum(axis=1)
    literals[ways & (choices == 1)[:, None]] = TRUE
    open_ = ways & (choices > 1)[:, None]
    if not open_.any():  # its motion is known
        if not choices.all():
            clauses.add(np.array([FALSE], dtype=np.int32))
        return clauses, literals
    literals[open_] = clauses.fresh(int(open_.sum()))
    for width in np.unique(choices).tolist():
        rows = np.flatnonzero(choices == width)
        at_once = literals[rows][ways[rows]].reshape(len(rows), width)
        clauses.add(at_once)
        add_at_most_one(clauses, at_once)
    source, target = roadmap.moves[:, 0], roadmap.moves[:, 1]
    live = ways[:-1, source] & ways[1:, target] & roadmap.allowed
    reserve(move_bytes * int(live.sum()), f"the moves of {len(ways) - 1} steps among {ways.shape[1]} states")
    into = np.argsort(target, kind="stable")
    add_moves(clauses, literals[:-1], literals[1:], live, source, target)
    add_moves(clauses, literals[1:], literals[:-1], live[:, into], target[into], source[into])
    return clauses, literals


def add_moves(clauses: Clauses, here: Literals, there: Literals, live: Flags, source: Indices, target: Indices) -> None:
    """Add that an agent in a source state at some step is in one of its target states at the adjacent step.

    The forward direction suffices. The backward direction adds a fifth more clauses, and makes proofs that there is no
    path five times faster.

    Args:
        here: literals of states, (steps, states); ``there``: likewise, at the adjacent steps.
        live: (steps, moves): True for existing moves.
        source: source state of each move, (moves,), sorted; ``target``: target states, (moves,).

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    step, move = np.nonzero(live)
    head = step * here.shape[1] + source[move]
    begins = np.flatnonzero(np.diff(head, prepend=-1))
    sizes = np.diff(np.append(begins, len(head)))
    heads = -here[step[begins], source[move[begins]]]
    clauses.add_ragged(heads[:, None], there[step, target[move]], sizes)


def add_at_most_one(clauses: Clauses, matrix: Literals) -> None:
    """Add that at most one literal of each row is true; ``matrix`` is (rows, literals).

    Raises:
        TooLarge: the clauses would exceed their limit.

    Source:
        Chen, "A new SAT encoding of the at-most-one constraint", 2010: rows and columns of a square, twice as many
        clauses as literals.
    """
    rows, width = matrix.shape
    pattern, extra = _at_most_one(width)
    clauses.reserve(rows * len(pattern))
    names = np.concatenate([matrix, clauses.fresh(rows * extra).reshape(rows, extra)], axis=1)
    pairs = np.sign(pattern) * names[:, np.abs(pattern) - 1]
    clauses.add(pairs.reshape(-1, 2))


@cache
def _at_most_one(width: int) -> tuple[Literals, int]:
    """At-most-one clauses, (clauses, 2), over literals 1 … ``width`` and auxiliary variables after them, and the number
    of auxiliary variables."""
    pairwise = 5  # literals up to which "at most one" is encoded pair by pair
    if width <= pairwise:
        pairs = [(-one, -other) for one in range(1, width + 1) for other in range(1, one)]
        return np.array(pairs, dtype=np.int32).reshape(-1, 2), 0
    rows = int(np.ceil(np.sqrt(width)))
    columns = -(-width // rows)
    number = np.arange(width)
    parts = [
        np.stack([-1 - number, width + 1 + number // columns], axis=1),
        np.stack([-1 - number, width + rows + 1 + number % columns], axis=1),
    ]
    extra = rows + columns
    for first, size in ((0, rows), (rows, columns)):
        inner, more = _at_most_one(size)
        names = np.concatenate([np.arange(size) + width + first, np.arange(more) + width + extra]) + 1
        parts.append(np.sign(inner) * names[np.abs(inner) - 1])
        extra += more
    return np.concatenate(parts).astype(np.int32), extra


Agents = frozenset[int]

Define = Callable[[Indices, Indices], Literals]
"""Function from cells, a step and a state (place) each, (cells,) twice, to their literals, (cells,)."""


class Tables:
    """Cache of literals by step and state, each created on demand."""

    def __init__(self, steps: int, places: int) -> None:
        self._shape = (steps, places)
        self._tables: dict[Hashable, Literals] = {}

    def look_up(self, key: Hashable, steps: Indices, places: Indices, define: Define) -> Literals:
        """Literals of these cells, (cells,); missing literals are defined together, each once."""
        if key not in self._tables:
            self._tables[key] = np.full(self._shape, NOTHING, dtype=np.int32)
        table = self._tables[key]
        literals = table[steps, places]
        unknown = literals == NOTHING
        if not unknown.any():
            return literals
        missing = np.zeros(self._shape, dtype=np.bool_)
        missing[steps[unknown], places[unknown]] = True
        step, place = np.nonzero(missing)
        table[step, place] = define(step, place)
        return table[steps, places]


class Occupancy:
    """Literals for occupied states; a cell is a pair of step and state (place), (cells,) each, and has one literal,
    (cells,)."""

    def __init__(self, motion: Motion, clauses: Clauses) -> None:
        self.motion, self.clauses = motion, clauses
        self._tables = Tables(motion.steps + 1, motion.places)
        self._states: dict[Agents, list[Literals]] = {}

    def occupied(self, agents: Agents, steps: Indices, places: Indices) -> Literals:
        """Literals that an agent of ``agents`` is in the state: (cells,)."""

        def define(steps: Indices, places: Indices) -> Literals:
            presence = self.presence(agents, steps, places)
            there = self._literals(agents, steps, places)
            named = _named(there)
            self.clauses.add(-presence[named], there[named])
            return presence

        return self._tables.look_up(("occupied", agents), steps, places, define)

    def vacant(self, agents: Agents, steps: Indices, places: Indices) -> Literals:
        """Literals that no agent of ``agents`` is in the state: (cells,)."""

        def define(steps: Indices, places: Indices) -> Literals:
            presence = self.presence(agents, steps, places)
            there = self._literals(agents, steps, places)
            cell, member = np.nonzero(_named(there)[:, None] & (there != FALSE))
            self.clauses.add(-there[cell, member], presence[cell])
            return -presence

        return self._tables.look_up(("vacant", agents), steps, places, define)

    def presence(self, agents: Agents, steps: Indices, places: Indices) -> Literals:
        """Variable shared by ``occupied`` and ``vacant``: (cells,); FALSE if none of the agents can be in the state.

        The variable has no clauses; callers use ``occupied`` or ``vacant``.
        """

        def define(steps: Indices, places: Indices) -> Literals:
            there = self._literals(agents, steps, places)
            presence: Literals = there.max(axis=1, initial=FALSE)  # for a single possible agent, its own literal
            presence[(there == TRUE).any(axis=1)] = TRUE
            named = _named(there)
            presence[named] = self.clauses.fresh(int(named.sum()))
            return presence

        return self._tables.look_up(("presence", agents), steps, places, define)

    def _literals(self, agents: Agents, steps: Indices, places: Indices) -> Literals:
        """Literals that each of the agents is in the state: (cells, agents), FALSE if impossible."""
        if agents not in self._states:
            self._states[agents] = [
                _side_by_side([self.motion.states[agent] for agent in roadmap.agents if agent in agents])
                if agents.intersection(roadmap.agents)
                else np.zeros((self.motion.steps + 1, len(roadmap.position), 0), dtype=np.int32)
                for roadmap in self.motion.roadmaps
            ]
        number = np.searchsorted(self.motion.first_place, places, side="right") - 1
        parts = self._states[agents]
        result = np.full((len(places), max(part.shape[-1] for part in parts)), FALSE, dtype=np.int32)
        for part, first in zip(range(len(parts)), self.motion.first_place[:-1], strict=True):
            cells = np.flatnonzero(number == part)
            result[cells, : parts[part].shape[-1]] = parts[part][steps[cells], places[cells] - first]
        return result


def _side_by_side(states: list[Literals]) -> Literals:
    """Literals of each agent in each state, side by side: (steps + 1, states, agents); agents with known motion share a
    column."""
    known = [np.abs(each).max() == TRUE for each in states]
    open_ = [each for each, is_known in zip(states, known, strict=True) if not is_known]
    together = [each for each, is_known in zip(states, known, strict=True) if is_known]
    return np.stack([*open_, *([np.maximum.reduce(together)] if together else [])], axis=-1)


def _named(there: Literals) -> np.ndarray:
    """Return true for each cell that needs a new literal: several agents may be in the state, and none is certain."""
    named: np.ndarray = ((there != FALSE).sum(axis=1) > 1) & ~(there == TRUE).any(axis=1)
    return named
