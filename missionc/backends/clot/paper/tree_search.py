"""Algorithm 2: a search over planning sequences and joint trajectories at once.

in   two functions: the possible next agents, and the planning of one agent
out  joint trajectories of all agents, best first, and the reason for the end
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import chain, islice
from typing import Protocol

import numpy as np

from missionc.backends.clot.paper.planning_sequence import Offers
from missionc.backends.clot.paper.search_tree import Node, Tree, similar_nodes
from missionc.backends.clot.settings import SearchSettings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array


class Candidate(Record, eq=False):
    """Candidate trajectory of one agent, (steps + 1, dim), metres.

    ``cost`` is the cost that the candidate adds to the cost of the agents planned before, (6) and (2). ``feasible`` is
    true if it violates no checked hard constraint.

    Source:
        [clot] IV-C.1 (II), τ^k.
    """

    trajectory: Array
    cost: float
    feasible: bool


class Expand(Protocol):
    """Interface of the planner of one more agent at each of several nodes, by Algorithm 1.

    The answer has a list of candidates for each piece of work, in order. A list without a feasible candidate is a
    failure. Random draws follow from ``seed``, so that a resumed search repeats them. ``samples`` is the number of
    trajectories to optimise for each piece.

    Source:
        [clot] Algorithm 2, lines 4 to 8.
    """

    def __call__(
        self, work: Sequence[tuple[Node, int]], samples: int, seed: int, /
    ) -> Sequence[Sequence[Candidate]]: ...


class Ending(Enum):
    """Reason for the end of a search."""

    IMPROVED = "a solution was found and improved"
    BUDGET = "the limit of expansions was reached"
    TIME = "the deadline has passed"
    STOPPED = "the caller stopped the search"
    EXHAUSTED = "every agent has expanded every node up to the limit"


class Solution(Record, eq=False):
    """Joint trajectory of all agents.

    ``sequence`` is the order of planning; ``trajectories`` are in mission order, (agents, steps + 1, dim), metres.

    Source:
        [clot] IV-C.1 (IV), a leaf ν̄ and its Γ.
    """

    sequence: tuple[int, ...]
    trajectories: Array
    cost: float


class TreeSearchResult(Record):
    """Solutions of a search, pairwise further apart than ``delta``, the cheapest first; an empty result proves nothing.

    Source:
        [clot] Algorithm 2, lines 13 to 15.
    """

    solutions: tuple[Solution, ...]
    ending: Ending


@dataclass(slots=True)
class TreeSearch:
    """State of Algorithm 2 between two rounds.

    Args:
        agents: number of agents.
        rounds: number of selections so far.
        expansions: number of local optimisations so far.
        pruned: number of exclusions of an agent at a node because a similar node failed with it.
        first: number of expansions at the first solution; None before it.
        ranks: priority of each agent: of the least tried agents, the lowest rank is next; empty if all agents have
            equal priority.

    Source:
        [clot] Algorithm 2.
    """

    agents: int
    offers: Offers
    expand: Expand
    settings: SearchSettings
    generator: np.random.Generator
    tree: Tree = field(default_factory=Tree)
    rounds: int = 0
    expansions: int = 0
    pruned: int = 0
    first: int | None = None
    ranks: tuple[int, ...] = ()
    _offered: dict[frozenset[int], tuple[int, ...]] = field(default_factory=dict)

    def run(self, deadline: float = math.inf, stop: Callable[[], bool] = lambda: False) -> TreeSearchResult:
        """Solutions found until no work is left, or until the budget, or the share for improvement after a first
        solution, is used up.

        Limits are checked between rounds, and no round is cut short. A search that ended by ``TIME`` or ``STOPPED``
        continues when run again, as if uninterrupted.

        Args:
            deadline: time on the clock of ``time.monotonic``, seconds.
            stop: function that returns true to end the search.

        Raises:
            ValueError: an expansion gives an invalid answer.

        Source:
            [clot] Algorithm 2, and IV-C.1 (IV), where the paper's runs end at a first solution.
        """
        while True:
            ending = self._ending(deadline, stop)
            if ending is not None:
                return TreeSearchResult(self.solutions(), ending)
            work = self.select()
            if not work:
                return TreeSearchResult(self.solutions(), Ending.EXHAUSTED)
            self._expand(work)

    def values(self) -> Array:
        """Value χ of every node, (nodes,), dimensionless: progress, minus the weighted cost, plus ψ.

        Source:
            [clot] (9), with ξ the cost of the trajectories so far; normalised like progress, unless ``printed``.
        """
        planned = np.array([len(planned) for planned in self.tree.planned])
        cost, psi = np.array(self.tree.cost), np.array(self.tree.psi(self.settings.reward))
        cost *= self.settings.eta
        values: Array = planned / self.agents - cost if self.settings.printed else (planned - cost) / self.agents
        values += psi
        return values

    def select(self) -> list[tuple[int, int]]:
        """Nodes to expand next, each with its agent; a node may occur several times if there are few, unless
        ``printed``.

        The nodes are the best by (9); the agent of a node is the least tried, then the lowest in ``ranks``, then a
        random one. The number of nodes goes from ``wide`` to ``narrow`` with the progress of the best node.

        Source:
            [clot] IV-C.1 (I), IV-C.2, Algorithm 2 lines 3 to 7.
        """
        best_first = np.argsort(-self.values(), kind="stable").tolist()
        ranked = filter(self._is_open, best_first)
        best = next(ranked, None)
        if best is None:
            return []
        size = self._between(self.settings.wide, self.settings.narrow, best)
        return list(islice(self._turns(chain((best,), ranked)), size))

    def solutions(self) -> tuple[Solution, ...]:
        """Solutions of the leaves, best first, without leaves within ``delta`` of a better leaf.

        The best leaf is the cheapest; with ``printed``, the leaf of the highest value: all leaves have the same
        progress, and the ψ of a leaf is its parent's.

        Source:
            [clot] IV-C.1 (IV).
        """
        tree, distinct_leaves = self.tree, list[int]()
        order = -self.values() if self.settings.printed else np.array(tree.cost)
        for leaf in sorted(tree.leaves(self.agents), key=lambda node: (order[node], node)):
            if not similar_nodes(
                tree.motions[leaf], [tree.motions[other] for other in distinct_leaves], self.settings.delta
            ):
                distinct_leaves.append(leaf)
        return tuple(map(self._solution, distinct_leaves))

    def _solution(self, leaf: int) -> Solution:
        node = self.tree.node(leaf)
        return Solution(node.planned, node.trajectories[np.argsort(node.planned)], node.cost)

    def _ending(self, deadline: float, stop: Callable[[], bool]) -> Ending | None:
        if self.first is not None and self.expansions >= self.first + self.settings.improvement:
            return Ending.IMPROVED
        if self.expansions >= self.settings.expansions * self.agents:
            return Ending.BUDGET
        if stop():
            return Ending.STOPPED
        return Ending.TIME if time.monotonic() >= deadline else None

    def _offers(self, node: int) -> tuple[int, ...]:
        planned = self.tree.planned[node]
        if planned not in self._offered:
            self._offered[planned] = tuple(self.offers(planned)) if len(planned) < self.agents else ()
        return self._offered[planned]

    def _may(self, node: int, agent: int) -> bool:
        return self.tree.tries[node].get(agent, 0) < self.settings.tries

    def _is_open(self, node: int) -> bool:
        return any(self._may(node, agent) for agent in self._offers(node))

    def _turns(self, ranked: Iterable[int]) -> Iterator[tuple[int, int]]:
        """Yield every node with one agent to expand it by. Unless ``printed``, then yield every node with a second
        agent, and so on."""
        queues: dict[int, list[int]] = {}
        for node in ranked:
            agents = [agent for agent in self._offers(node) if self._may(node, agent)]
            shuffled = self.generator.permutation(agents).tolist()
            queues[node] = sorted(shuffled, key=lambda agent: self._turn(node, agent), reverse=True)
            yield node, queues[node].pop()
        while not self.settings.printed and any(queues.values()):
            for node, queue in queues.items():
                if queue:
                    yield node, queue.pop()

    def _turn(self, node: int, agent: int) -> tuple[int, int]:
        return self.tree.tries[node].get(agent, 0), self.ranks[agent] if self.ranks else 0

    def _between(self, at_root: int, at_end: int, node: int) -> int:
        """Number interpolated between two numbers by the progress of a node that is not a leaf."""
        progress = len(self.tree.planned[node]) / max(1, self.agents - 1)
        return round(at_root + (at_end - at_root) * progress)

    def _expand(self, work: list[tuple[int, int]]) -> None:
        """Run one round: expand all selected nodes together, then back-propagate all outcomes."""
        settings = self.settings
        samples = self._between(settings.few_samples, settings.many_samples, work[0][0])
        seed = int(self.generator.integers(2**63))
        answers = self.expand([(self.tree.node(node), agent) for node, agent in work], samples, seed)
        if len(answers) != len(work):
            raise ValueError(f"{len(work)} tasks, but {len(answers)} results")
        outcomes = [self._outcome(node, agent, answer) for (node, agent), answer in zip(work, answers, strict=True)]
        for (node, _), outcome in zip(work, outcomes, strict=True):
            self.tree.back_propagate(node, outcome, settings.gamma)
        self.rounds += 1
        self.expansions += len(work)
        if self.first is None and self.tree.leaves(self.agents):
            self.first = self.expansions

    def _outcome(self, node: int, agent: int, candidates: Sequence[Candidate]) -> float:
        """Outcome of an expansion, after its children are added to the tree; a failure without a new child."""
        tries = self.tree.tries[node]
        tries[agent] = tries.get(agent, 0) + 1
        feasible = sorted((candidate for candidate in candidates if candidate.feasible), key=lambda one: one.cost)
        if not feasible:
            self._prune(node, agent)
        children = 0
        for candidate in feasible:
            if children == self.settings.children:
                break
            if self._is_new(node, agent, candidate):
                self.tree.add(node, agent, candidate.trajectory, candidate.cost)
                children += 1
        return self.settings.reward if children else -self.settings.reward

    def _is_new(self, node: int, agent: int, candidate: Candidate) -> bool:
        """Return true if no similar node is at least as cheap as this candidate's node."""
        cost = self.tree.cost[node] + candidate.cost
        similar = self.tree.similar(node, agent, candidate.trajectory, self.settings.delta)
        return all(self.tree.cost[other] > cost for other in similar)

    def _prune(self, node: int, agent: int) -> None:
        """Exclude this agent at nodes similar to a node that failed with it; with ``printed``, exclude all agents.

        Source:
            [clot] IV-C.2, which removes the nodes; unless ``printed``, only the failed expansion is removed, since
            another agent may succeed.
        """
        barred = range(self.agents) if self.settings.printed else (agent,)
        for other in self.tree.twins(node, self.settings.delta):
            if any(self._may(other, each) for each in barred):
                self.tree.tries[other].update(dict.fromkeys(barred, self.settings.tries))
                self.pruned += 1
