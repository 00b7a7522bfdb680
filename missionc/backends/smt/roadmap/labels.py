"""Roadmap labels: the states, the moves and the pairs of states in which each predicate holds."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace

import numpy as np

from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Array, Flags
from missionc.ir import (
    Compare,
    Connected,
    DistanceBetween,
    DistanceTo,
    Feature,
    FormationEdge,
    InFormation,
    Mission,
    Predicate,
)
from missionc.language.margins.predicate_margins import formation_margin, holds, of_pair, of_states


class Unexpressible(ValueError):
    """A predicate that neither a state, nor a move, nor the states of two agents decide."""


class Labels:
    """Truth on roadmap states, worked out once for each predicate; ``roadmap_of`` has the number of each agent's."""

    def __init__(self, mission: Mission, roadmaps: tuple[Roadmap, ...]) -> None:
        self.mission, self.roadmaps = mission, roadmaps
        self.roadmap_of = {agent: number for number, roadmap in enumerate(roadmaps) for agent in roadmap.agents}
        self._known: dict[Hashable, Flags] = {}

    def of_places(self, predicate: Predicate) -> bool:
        """Whether the place alone decides it, whoever stands there."""
        if isinstance(predicate, InFormation | Connected) or others(predicate, -1):
            return False
        return not any(self.of_moves(predicate, number) for number in range(len(self.roadmaps)))

    def of_moves(self, predicate: Predicate, number: int) -> bool:
        """Whether it depends on the motion that starts at a step, not on the state in that roadmap alone."""
        first = self.roadmaps[number].agents[0]
        return predicate.reads_speed and not self.mission.agents[first].dynamics.has_momentum

    def places(self, predicate: Predicate) -> Flags:
        """At which places it holds: (places,)."""
        return np.concatenate([self.states(predicate, number) for number in range(len(self.roadmaps))])

    def states(self, predicate: Predicate, number: int) -> Flags:
        """In which states of that roadmap it holds: (states,)."""
        roadmap = self.roadmaps[number]
        return self._own(predicate, number, "states", lambda: (roadmap.position, roadmap.velocity))

    def standing(self, predicate: Predicate, number: int) -> Flags:
        """In which states of that roadmap it holds of an agent that never moves: (states,)."""
        position = self.roadmaps[number].position
        return self._own(predicate, number, "standing", lambda: (position, np.zeros_like(position)))

    def moves(self, predicate: Predicate, number: int, *, at_end: bool) -> Flags:
        """During which moves it holds, in the state they start from or, ``at_end``, end in: (moves,)."""
        position = self.roadmaps[number].position
        source, target = self.roadmaps[number].moves.T

        def states() -> tuple[Array, Array]:
            velocity = (position[target] - position[source]) / self.mission.step
            return position[target if at_end else source], velocity

        return self._own(predicate, number, "ends" if at_end else "begins", states)

    def edge(self, predicate: InFormation, edge: FormationEdge, first: int, second: int) -> Flags:
        """With the edge's ends in which states of those roadmaps it is within the tolerance: (states, states).

        Raises:
            Unexpressible: the formation has a total tolerance over several edges.
        """
        formation = predicate.formation
        if formation.total and len(formation.edges) > 1:
            raise Unexpressible(f"the total tolerance of `{formation.name}`")
        key = (formation, edge, first, second)
        if key not in self._known:
            one, other = self.roadmaps[first].position, self.roadmaps[second].position
            margins = formation_margin(formation, edge, one[:, None, :], other[None, :, :])
            self._known[key] = np.asarray(holds(predicate, np.asarray(margins)))
        return self._known[key]

    def pair(self, predicate: Compare, agents: tuple[int, int], first: int, second: int) -> Flags:
        """With the two agents in which states it holds of the first: (states, states).

        Raises:
            Unexpressible: it reads a speed, or a third agent.
        """
        key = (predicate, agents, first, second)
        if key not in self._known:
            one, other = self.roadmaps[first].position, self.roadmaps[second].position
            try:
                margins = of_pair(predicate, self.mission, *agents, one[:, None, :], other[None, :, :])
            except ValueError as error:
                raise Unexpressible(f"a comparison: {error}") from error
            self._known[key] = np.asarray(holds(predicate, np.asarray(margins)))
        return self._known[key]

    def _own(self, predicate: Predicate, number: int, what: str, states: Callable[[], tuple[Array, Array]]) -> Flags:
        key = (predicate, number, what)
        if key not in self._known:
            margins = of_states(predicate, self.mission, self.roadmaps[number].agents[0], *states())
            self._known[key] = np.asarray(holds(predicate, np.asarray(margins)))
        return self._known[key]


def others(predicate: Predicate, agent: int) -> frozenset[int]:
    """Whose states a comparison reads when asked of ``agent``, besides that agent's own."""
    read: set[int] = set()
    for _, feature in predicate.terms if isinstance(predicate, Compare) else ():
        match feature:
            case DistanceTo(int() as target):
                read.add(target)
            case DistanceBetween(first, second):
                read |= {first, second}
            case _:
                pass
    return frozenset(read - {agent})


def simplified(predicate: Predicate, agent: int) -> Predicate:
    """Without the distances between an agent and itself, which are 0."""

    def counts(feature: Feature) -> bool:
        match feature:
            case DistanceTo(int() as target):
                return target != agent
            case DistanceBetween(first, second):
                return first != second
            case _:
                return True

    if not isinstance(predicate, Compare) or all(counts(feature) for _, feature in predicate.terms):
        return predicate
    return replace(predicate, terms=tuple(term for term in predicate.terms if counts(term[1])))
