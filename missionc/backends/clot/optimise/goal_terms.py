"""Goals of a candidate: formulas that must be true at step 0, and the choices of a witness."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from missionc.backends.clot.cost_graph.cost_graph import SignedPredicate
from missionc.backends.clot.optimise.active_set import Active, Choices, activate
from missionc.backends.clot.optimise.condition_values import ConditionValues
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Atom, Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import children, graph_of, postorder


class Demand(Record, eq=False):
    """Goals of joint trajectories, with methods on their positions and velocities, (agents, steps, dim), metres and
    m/s.

    Args:
        roots: formulas that must be true at step 0 (for a single configuration, at its step).
        choices: fixed choices; without a choice, the values decide.
    """

    mission: Mission
    roots: tuple[Node, ...]
    choices: Choices = field(default_factory=dict)
    order: Sequence[Node] = ()
    ruled_out: Mapping[SignedPredicate, Flags] = field(default_factory=dict)
    """Agents and steps, (agents, steps), at which predicates or negations are impossible because of fixed choices."""

    @staticmethod
    def of(mission: Mission, roots: tuple[Node, ...], choices: Choices, steps: int) -> Demand:
        """Goals of trajectories with ``steps`` steps."""
        order = postorder(roots)
        nowhere = np.zeros((len(mission.agents), steps + 1, 0))
        forced = activate(order, roots, {}, {}, nowhere, choices, decided=True).margins
        ruled_out = {(predicate, not holds): mask for (predicate, holds), mask in forced.items() if mask.any()}
        return Demand(mission, roots, choices, order, ruled_out)

    def active(self, position: Array, velocity: Array) -> Active:
        """Conditions that imply the goals on this trajectory, (agents, steps, dim), metres and m/s; values decide open
        choices."""
        return self._activated(position, velocity, None)

    def witness(self, position: Array, velocity: Array) -> Choices:
        """Choices of part, step and link that the values imply on this trajectory, (agents, steps, dim), metres and
        m/s."""
        choices: dict[tuple[Node, int, int], int] = {}
        self._activated(position, velocity, choices)
        return choices

    def states_asked(self, position: Array, velocity: Array) -> Mapping[Node, Flags]:
        """Largest single-step formulas that must be true, each with the agents and steps at which they must be,
        (agents, steps).

        Args:
            position: (agents, steps, dim), metres; ``velocity``, m/s.
        """
        whole: set[Node] = set()
        for node in self.order:
            reads_past = isinstance(node, Atom) and node.predicate.reads_past
            if not isinstance(node, WindowNode | UntilNode) and not reads_past and whole.issuperset(children(node)):
                whole.add(node)
        return self._activated(position, velocity, None, whole).formulas

    def failing(self, allowed: Mapping[Node, float], position: Array, velocity: Array) -> Mapping[Node, Flags]:
        """Agents and steps, (agents, steps), at which a formula must be true but fails by more than its allowed
        violation.

        Args:
            allowed: allowed violation of each formula, metres.
        """
        values = ConditionValues(self.mission, position, velocity, self.ruled_out).values(self.order)
        asked = self._activated(position, velocity, None, allowed.keys()).formulas
        return {leaf: mask & (values[leaf] < -allowed[leaf]) for leaf, mask in asked.items()}

    def _activated(
        self,
        position: Array,
        velocity: Array,
        witness: dict[tuple[Node, int, int], int] | None,
        whole: Collection[Node] = frozenset(),
    ) -> Active:
        evaluation = ConditionValues(self.mission, position, velocity, self.ruled_out)
        values = evaluation.values(self.order)
        graphs = {graph for node in self.order if (graph := graph_of(node))}
        links = {graph: evaluation.links_of(graph, slice(None)) for graph in graphs}
        everyone = np.arange(len(self.mission.agents))
        closest = SpacingTable.of(self.mission).between(everyone[:, None], everyone)
        return activate(self.order, self.roots, values, links, position, self.choices, False, witness, closest, whole)

    def untangled(self, position: Array, velocity: Array) -> Demand | None:
        """Goals without conflicts between a margin and its opposite; None if there are no conflicts.

        Two separate choices may require both, each nearly satisfied, and an optimiser is then stuck between them:
        ``(row or parked) and (fan or not parked)``, on the border of the parking region. Positions are (agents, steps,
        dim), metres.
        """
        masks = self.active(position, velocity).margins
        torn = []
        for (predicate, holds), mask in masks.items():
            opposite = masks.get((predicate, False)) if holds else None
            if opposite is not None:
                steps = (mask & opposite).any(axis=0)
                torn += [(predicate, steps)] if steps.any() else []
        if not torn:
            return None
        sides = []
        for truth in (True, False):
            ruled_out = dict(self.ruled_out)
            for predicate, steps in torn:
                dropped, where = (predicate, not truth), masks[predicate, truth] & steps
                ruled_out[dropped] = ruled_out[dropped] | where if dropped in ruled_out else where
            sides.append(replace(self, ruled_out=ruled_out))
        return max(sides, key=lambda side: side.worst(position, velocity))

    def worst(self, position: Array, velocity: Array) -> float:
        """Least robustness of the root formulas, metres, for states (agents, steps, dim)."""
        values = ConditionValues(self.mission, position, velocity, self.ruled_out).values(self.order)
        return min(float(values[root][0, 0]) for root in self.roots)
