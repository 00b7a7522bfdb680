"""Encoding of predicates: literals over the possible states of an agent at a step.

- State predicate: the agent is in a state in which the predicate is true (or in none in which it is false).
- Move predicate: the agent makes no move during which the predicate is false.
- Pair predicate: the two agents are in compatible states.
"""

from __future__ import annotations

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.roadmap.labels import Labels, Unexpressible
from missionc.base.trace import Flags, Indices
from missionc.ir import Flag, Flagged, Inside, Predicate

FEW = 3
"""Maximum ratio of excluded to allowed states for which clauses exclude states one by one: they propagate better."""


class Atoms:
    """Literals for predicates; a cell is a pair of agent and step, (cells,) each."""

    def __init__(self, labels: Labels, motion: Motion, clauses: Clauses) -> None:
        self.labels, self.motion, self.clauses = labels, motion, clauses
        self._flags: dict[tuple[Flag, bool, int], Literals] = {}
        self._truths: dict[tuple[Predicate, tuple[int, ...]], Literals] = {}

    def holds(self, predicate: Predicate, truth: bool, agents: Indices, steps: Indices) -> Literals:
        """Literals that imply the predicate in each cell, or without ``truth`` its negation: (cells,).

        Raises:
            Unexpressible: the predicate depends on more than two agents, on a speed and another agent, or on a
                resource.
        """
        parts = self.labels.parts(predicate)
        if parts != (predicate,):
            pairs = [self._of_agent(part, truth, part.pairs[0][0], steps) for part in parts]
            neutral = np.full(len(steps), TRUE if truth else FALSE, dtype=np.int32)
            return (self.clauses.all_of if truth else self.clauses.any_of)(neutral, *pairs)
        result = np.full(len(agents), FALSE, dtype=np.int32)
        for agent in np.unique(agents).tolist():
            cells = agents == agent
            result[cells] = self._of_agent(predicate, truth, agent, steps[cells])
        return result

    def _of_agent(self, predicate: Predicate, truth: bool, agent: int, steps: Indices) -> Literals:
        if isinstance(predicate, Flagged):
            return self._flag(predicate.flag, truth, agent)[steps]
        if predicate.reads_past:
            raise Unexpressible("a resource requirement that no single-agent plan satisfies")
        predicate = predicate.asked_of(agent)
        reads_own = predicate.reads_oneself(self.labels.mission.dimension)
        match sorted(predicate.others - {agent}):
            case []:
                return self._own(predicate, truth, agent, steps)
            case [other]:
                first, second = agent, other
            case [first, second] if not reads_own:
                pass
            case _:
                raise Unexpressible("a predicate about more than two agents")
        numbers = int(self.motion.roadmap_of[first]), int(self.motion.roadmap_of[second])
        fits, fails = (
            self.labels.pairs_where(predicate, (first, second), *numbers, each) for each in (truth, not truth)
        )
        return self._either(
            predicate, truth, (first, second), steps, self._pair(fits, first, second, steps), fits & fails
        )

    def _own(self, predicate: Predicate, truth: bool, agent: int, steps: Indices) -> Literals:
        number = int(self.motion.roadmap_of[agent])
        if not self.labels.of_moves(predicate, number):
            fits, fails = (self.labels.states_where(predicate, number, each) for each in (truth, not truth))
            return self._either(predicate, truth, (agent,), steps, self._in(fits, agent, steps), fits & fails)
        if self.motion.steps == 0:
            return self._in(self.labels.standing(predicate, number) == truth, agent, steps)
        last = steps == self.motion.steps
        result = np.empty(len(steps), dtype=np.int32)
        fits = self.labels.moves(predicate, number, truth, at_end=False)
        result[~last] = self._by_moves(fits, agent, steps[~last])
        fits = self.labels.moves(predicate, number, truth, at_end=True)
        result[last] = self._by_moves(fits, agent, steps[last] - 1)
        return result

    def _either(
        self, predicate: Predicate, truth: bool, agents: tuple[int, ...], steps: Indices, found: Literals, both: Flags
    ) -> Literals:
        """Literals of a predicate that labels leave undecided: for ``agents`` at a step, the predicate is true or
        false, not both."""
        if not both.any():
            return found
        key = predicate, agents
        if key not in self._truths:
            self._truths[key] = self.clauses.fresh(self.motion.steps + 1)
        holds = self._truths[key][steps]
        return self.clauses.all_of(found, holds if truth else -holds)

    def _flag(self, flag: Flag, truth: bool, agent: int) -> Literals:
        """Literals that imply that the agent's flag is set, or not set, at each step: (steps + 1,)."""
        key = flag, truth, agent
        if key not in self._flags:
            steps = np.arange(self.motion.steps + 1)
            if agent not in flag.agents:
                self._flags[key] = np.full(len(steps), FALSE if truth else TRUE, dtype=np.int32)
                return self._flags[key]
            sets = self._own(Inside(flag.set_in, body=False), truth, agent, steps)
            cleared = flag.cleared_in
            stays = np.full(len(steps), TRUE if truth else FALSE, dtype=np.int32)
            if cleared is not None:
                stays = self._own(Inside(cleared, body=False), not truth, agent, steps)
            found = sets.copy()
            for step in range(1, len(steps)):
                now, before = slice(step, step + 1), slice(step - 1, step)
                if truth:
                    found[now] = self.clauses.either(sets[now], found[before], stays[now])
                else:
                    found[now] = self.clauses.all_of(sets[now], self.clauses.any_of(found[before], stays[now]))
            self._flags[key] = found
        return self._flags[key]

    def where(self, there: Literals, able: Flags, conditions: Literals) -> Literals:
        """For each row, a literal that implies the condition on the agent's state: (rows,).

        For an agent outside the problem, only conditions that are true in all its possible states are implied.

        Args:
            there: literal that the agent is in the state, (rows, states).
            able: True if the agent can be in the state, (rows, states).
            conditions: literal of the condition on the state, (rows, states).
        """
        inside, outside = np.where(conditions == TRUE, there, FALSE), np.where(conditions == FALSE, there, FALSE)
        result = np.full(len(there), FALSE, dtype=np.int32)
        result[(~able | (conditions == TRUE)).all(axis=1)] = TRUE
        can = there != FALSE
        open_ = (result == FALSE) & (can & (conditions != FALSE)).any(axis=1)
        plain = (~can | (np.abs(conditions) == 1)).all(axis=1)
        few = plain & ((outside != FALSE).sum(axis=1) > FEW * (inside != FALSE).sum(axis=1))
        result[open_ & few] = self.clauses.any_of(inside[open_ & few])
        result[open_ & plain & ~few] = self.clauses.all_of(-outside[open_ & plain & ~few])
        rest = open_ & ~plain
        result[rest] = self.clauses.fresh(int(rest.sum()))
        row, state = np.nonzero(can & (conditions != TRUE) & rest[:, None])
        self.clauses.add(-result[row], -there[row, state], conditions[row, state])
        return result

    def _in(self, fits: Flags, agent: int, steps: Indices) -> Literals:
        """Literals that the agent is in one of the flagged states, (states,), at each step: (cells,)."""
        there = self.motion.states[agent][steps]
        conditions = np.broadcast_to(np.where(fits, TRUE, FALSE), there.shape)
        return self.where(there, self.motion.ways[agent][steps], conditions)

    def _by_moves(self, fits: Flags, agent: int, steps: Indices) -> Literals:
        """Literals that the agent makes one of the flagged moves, (moves,), from each step: (cells,)."""
        roadmap, states = self.motion.roadmap(agent), self.motion.states[agent]
        source, target = roadmap.moves.T
        from_, to = states[steps][:, source], states[steps + 1][:, target]
        made = (from_ == TRUE) & (to == TRUE)  # also where others are excluded because of this agent
        live = (from_ != FALSE) & (to != FALSE) & (roadmap.allowed[steps] | made)
        result = np.full(len(steps), FALSE, dtype=np.int32)
        result[(live <= fits).all(axis=1) & live.any(axis=1)] = TRUE
        open_ = (result == FALSE) & (live & fits).any(axis=1)
        result[open_] = self.clauses.fresh(int(open_.sum()))
        row, move = np.nonzero(live & ~fits & open_[:, None])
        self.clauses.add(-result[row], -from_[row, move], -to[row, move])
        return result

    def _pair(self, fits: Flags, first: int, second: int, steps: Indices) -> Literals:
        """Literals that the two agents are in compatible states, (states, states), at each step: (cells,)."""
        result = np.full(len(steps), FALSE, dtype=np.int32)
        for cell, step in enumerate(steps.tolist()):
            one, other = self.motion.states[first][step], self.motion.states[second][step]
            rows, columns = np.flatnonzero(one != FALSE), np.flatnonzero(other != FALSE)
            together = fits[np.ix_(rows, columns)]
            if together.all() or not together.any():
                result[cell] = TRUE if together.size and together.all() else FALSE
                continue
            result[cell] = name = int(self.clauses.fresh(1)[0])
            apart = FEW * (~together).sum(axis=1) < together.sum(axis=1)
            row, column = np.nonzero(~together & apart[:, None])
            self.clauses.add(-name, -one[rows[row]], -other[columns[column]])
            row, column = np.nonzero(together[~apart])
            heads = np.stack([np.full(int((~apart).sum()), -name, dtype=np.int32), -one[rows[~apart]]], axis=1)
            self.clauses.add_ragged(heads, other[columns[column]], np.bincount(row, minlength=len(heads)))
        return result
