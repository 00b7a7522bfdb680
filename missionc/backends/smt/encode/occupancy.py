"""Occupancy literals: some agent, or no agent, in a roadmap state."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, NOTHING, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Indices

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
