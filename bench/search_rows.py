"""Benchmark of the hybrid search's expansions on rows of agents, with and without learning (ψ).

    python bench/search_rows.py [SEEDS]

Adjacent agents of a row must stay within one lane of each other, low lanes are cheap, and some agents fit only into the
highest lane. Prints, for each row and ``reward``, the number of seeds that were solved within 40 expansions for each
agent, and the mean and maximum number of expansions for each agent.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from missionc.backends.clot.paper.planning_sequence import of_phases
from missionc.backends.clot.paper.search_tree import Node
from missionc.backends.clot.paper.tree_search import Candidate, Expand, TreeSearch
from missionc.backends.clot.settings import SearchSettings

LANES = 4


def row(narrow: frozenset[int]) -> Expand:
    """All lanes that fit an agent and its planned neighbours; ``narrow`` agents fit in the last one only."""

    def candidates(node: Node, agent: int) -> list[Candidate]:
        near = [
            float(path[0, 0])
            for path, other in zip(node.trajectories, node.planned, strict=True)
            if abs(other - agent) == 1
        ]
        fits = (LANES - 1,) if agent in narrow else range(LANES)
        return [
            Candidate(np.full((3, 1), float(lane)), lane / 3, all(abs(lane - other) <= 1 for other in near))
            for lane in fits
        ]

    def expand(work: Sequence[tuple[Node, int]], samples: int, seed: int) -> list[list[Candidate]]:
        return [candidates(node, agent) for node, agent in work]

    return expand


def main(seeds: int) -> None:
    for agents in (5, 8, 12, 20):
        couplings = of_phases([(0, 2, list(pairwise(range(agents))))], agents)
        for narrow in ({agents - 1}, {agents // 2}, {agents // 3, 2 * agents // 3}):
            for reward in (0.0, 0.2, SearchSettings().reward, 1.0):
                settings = SearchSettings(reward=reward, expansions=40)
                effort, solved = [], 0
                for seed in range(seeds):
                    generator = np.random.default_rng(seed)
                    search = TreeSearch(agents, couplings.next_agents, row(frozenset(narrow)), settings, generator)
                    solved += bool(search.run().solutions)
                    effort.append(search.expansions / agents)
                print(
                    f"{agents:2d} agents, narrow {sorted(narrow)!s:8} reward {reward:3.1f}: {solved} of {seeds} solved,"
                    f" {statistics.mean(effort):5.2f} expansions for each agent (most {max(effort):5.2f})",
                    flush=True,
                )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
