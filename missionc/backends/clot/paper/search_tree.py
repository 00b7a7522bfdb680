"""Search tree of Algorithm 2: partial joint trajectories with their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array


class Node(Record, eq=False):
    """Planned agents with their trajectories, a node of the search tree.

    ``planned`` is in the order of planning; ``trajectories`` are in the same order, (planned, steps + 1, dim), metres.
    ``cost`` is the sum of the trajectories' costs.

    Source:
        [clot] IV-C.1, ν = (N_ν, Γ_ν).
    """

    index: int
    planned: tuple[int, ...]
    trajectories: Array
    cost: float


@dataclass(slots=True)
class Tree:
    """Search tree; its nodes have indices, parents before children.

    Source:
        [clot] IV-C.1, 𝔗 = (V, →).
    """

    parent: list[int] = field(default_factory=lambda: [-1])
    agent: list[int] = field(default_factory=lambda: [-1])
    cost: list[float] = field(default_factory=lambda: [0.0])
    earned: list[float] = field(default_factory=lambda: [0.0])
    """Sum of the discounted outcomes below each node."""
    visits: list[int] = field(default_factory=lambda: [0])
    """Number of outcomes below each node."""
    tries: list[dict[int, int]] = field(default_factory=lambda: [{}])
    """Number of expansions of each node, by agent."""
    planned: list[frozenset[int]] = field(default_factory=lambda: [frozenset()])
    motions: list[dict[int, Array]] = field(default_factory=lambda: [{}])
    """Trajectories of each node by agent in planning order, (steps + 1, dim), metres; only the last is new."""
    _alike: dict[frozenset[int], list[int]] = field(default_factory=lambda: {frozenset(): [0]})

    def __len__(self) -> int:
        return len(self.parent)

    def add(self, parent: int, agent: int, trajectory: Array, cost: float) -> int:
        """Add a child with one more planned agent, by (10), and return its index.

        Args:
            trajectory: trajectory of the agent, (steps + 1, dim), metres.
            cost: cost of the trajectory.

        Raises:
            ValueError: the agent is already planned, the trajectory has a different shape, or a number is not finite.

        Source:
            [clot] (10).
        """
        if agent in self.planned[parent]:
            raise ValueError(f"agent {agent} is planned already")
        if len(self) > 1 and trajectory.shape != self.shape:
            raise ValueError(f"a trajectory of shape {trajectory.shape} does not match the shape {self.shape}")
        if not (np.isfinite(cost) and np.isfinite(trajectory).all()):
            raise ValueError(f"a trajectory or its cost is not finite (cost {cost})")
        index = len(self)
        self.parent.append(parent)
        self.agent.append(agent)
        self.cost.append(self.cost[parent] + cost)
        self.earned.append(0.0)
        self.visits.append(0)
        self.tries.append({})
        self.planned.append(self.planned[parent] | {agent})
        self.motions.append({**self.motions[parent], agent: np.array(trajectory, dtype=np.float64)})
        self._alike.setdefault(self.planned[index], []).append(index)
        return index

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one trajectory, (steps + 1, dim); (0, 0) before there is one."""
        return self.motions[1][self.agent[1]].shape if len(self) > 1 else (0, 0)

    def leaves(self, agents: int) -> tuple[int, ...]:
        """Indices of the nodes with all agents planned.

        Source:
            [clot] IV-C.1 (IV), V̄*.
        """
        return tuple(self._alike.get(frozenset(range(agents)), ()))

    def node(self, index: int) -> Node:
        """Node with this index, with all its trajectories.

        Source:
            [clot] IV-C.1.
        """
        motions = self.motions[index]
        joint = np.array(list(motions.values())).reshape(len(motions), *self.shape)
        return Node(index, tuple(motions), joint, self.cost[index])

    def similar(self, parent: int, agent: int, trajectory: Array, delta: float) -> list[int]:
        """Indices of the nodes that are similar to a new child of ``parent``: the same agents, and a distance below
        ``delta`` metres.

        The distance of two joint trajectories is the largest distance between an agent's two positions over agents and
        steps; ``trajectory`` is the agent's, (steps + 1, dim), metres.

        Source:
            [clot] IV-C.2, ‖Γ_ν - Γ_ν'‖ < δ.
        """
        others = self._alike.get(self.planned[parent] | {agent}, [])
        mine = {**self.motions[parent], agent: trajectory}
        return [others[place] for place in similar_nodes(mine, [self.motions[other] for other in others], delta)]

    def twins(self, index: int, delta: float) -> list[int]:
        """Indices of the other nodes that are similar to a node: the same agents, and a distance below ``delta``
        metres.

        Source:
            [clot] IV-C.2.
        """
        others = [other for other in self._alike[self.planned[index]] if other != index]
        return [
            others[place]
            for place in similar_nodes(self.motions[index], [self.motions[other] for other in others], delta)
        ]

    def back_propagate(self, index: int, outcome: float, gamma: float) -> None:
        """Add an outcome just below a node to the node and all its ancestors, with a factor ``gamma`` per edge.

        Source:
            [clot] (11), with d(ν, ν⁺) from 1 at the node that was expanded.
        """
        while index >= 0:
            outcome *= gamma
            self.earned[index] += outcome
            self.visits[index] += 1
            index = self.parent[index]

    def psi(self, reward: float) -> list[float]:
        """Value ψ of every node: the mean of its outcomes and of its parent's ψ, which counts as one more outcome.

        The sum in (11) grows without bound for visited nodes and ignores failures; a mean over both does not. The
        parent's ψ (``reward`` at the root) is a prior for unvisited nodes, so that failures of siblings count too.

        Source:
            [clot] (11), normalised.
        """
        psi: list[float] = []
        for parent, earned, visits in zip(self.parent, self.earned, self.visits, strict=True):
            psi.append(((reward if parent < 0 else psi[parent]) + earned) / (1 + visits))
        return psi


def similar_nodes(mine: dict[int, Array], others: Sequence[dict[int, Array]], delta: float) -> list[int]:
    """Indices of the joint trajectories that are less than ``delta`` metres from ``mine``, for the same agents.

    A joint trajectory contains the trajectory of each agent, (steps + 1, dim), metres.

    Source:
        [clot] IV-C.2, ‖Γ_ν - Γ_ν'‖ < δ.
    """
    left = list(range(len(others)))
    # The last planned first: motions mostly differ there.
    for agent in reversed(mine):
        if not left:
            break
        between = np.array([others[place][agent] for place in left]) - mine[agent]
        furthest = np.einsum("osd,osd->os", between, between).max(axis=1, initial=0.0)
        left = [place for place, square in zip(left, furthest.tolist(), strict=True) if square < delta * delta]
    return left
