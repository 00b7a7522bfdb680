"""What is asked of a candidate: terms that must hold at step 0, and what a witness decided."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.active import Active, Choices, activate
from missionc.backends.clot.cost_graph import EveryLinked, Length, Margin, SomeLinked, Term, postorder
from missionc.backends.clot.robustness import Robustness
from missionc.backends.clot.states import States, Team, team
from missionc.ir import Mission
from missionc.plan import Array


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """Args:
    roots: the terms that must hold, at step 0 (of a single configuration: at its step).
    choices: what is decided already; elsewhere the values decide.
    """

    mission: Mission
    roots: tuple[Term, ...]
    choices: Choices = field(default_factory=dict)
    order: tuple[Term, ...] = ()
    team: Team | None = None
    ruled_out: Mapping[Margin, Tensor] = field(default_factory=dict)
    """Where margins cannot hold, (agents, steps), for what is decided needs the opposite."""

    @staticmethod
    def of(mission: Mission, roots: tuple[Term, ...], choices: Choices, steps: int) -> Demand:
        """What is asked of motions of so many steps."""
        order = postorder(roots)
        nowhere = np.zeros((len(mission.agents), steps + 1, 0))
        forced = activate(order, roots, {}, {}, nowhere, choices, decided=True).margins
        opposite = {(margin.predicate, not margin.holds): mask for margin, mask in forced.items() if mask.any()}
        ruled_out = {
            term: torch.from_numpy(opposite[term.predicate, term.holds])
            for term in order
            if isinstance(term, Margin) and (term.predicate, term.holds) in opposite
        }
        return Demand(mission, roots, choices, order, team(mission, dtype=torch.float64), ruled_out)

    def active(self, position: Array, velocity: Array) -> Active:
        """What has to hold, chosen by the values on this motion where no witness decided."""
        return self._activated(position, velocity, None)

    def witness(self, position: Array, velocity: Array) -> Choices:
        """What the values on this motion choose: which part, which step and which link makes each of the roots hold."""
        found: dict[tuple[Term, int, int], int] = {}
        self._activated(position, velocity, found)
        return found

    def _activated(self, position: Array, velocity: Array, witness: dict[tuple[Term, int, int], int] | None) -> Active:
        robustness, values = self._evaluated(position, velocity)
        graphs = {term.graph for term in self.order if isinstance(term, SomeLinked | EveryLinked | Length)}
        links = {graph: robustness.links(graph)[0].numpy() for graph in graphs}
        radius = np.array([agent.radius for agent in self.mission.agents])
        closest = radius[:, None] + radius + self.mission.separation
        return activate(self.order, self.roots, values, links, position, self.choices, False, witness, closest)

    def _evaluated(self, position: Array, velocity: Array) -> tuple[Robustness, Mapping[Term, Array]]:
        assert self.team is not None
        states = States(torch.from_numpy(position)[None], torch.from_numpy(velocity)[None])
        with torch.no_grad():
            robustness = Robustness(self.team, states, self.ruled_out)
            return robustness, {term: value[0].numpy() for term, value in robustness.values(self.order).items()}
