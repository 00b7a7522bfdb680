"""Settings of the hybrid search: its width, its depth and its length; every figure in one value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """The parameters of Algorithm 2.

    The paper prints none of them but the number of trajectories, so the
    defaults are this project's.

    Raises:
        ValueError: a number is outside what its line says.

    Source:
        [clot] (9), (11), IV-C.
    """

    eta: float = 0.2
    """η of (9), at least 0: the weight of the cost for each agent of the mission, against progress from 0 to 1."""
    gamma: float = 0.8
    """γ of (11), above 0 and below 1."""
    reward: float = 0.5
    """ψ(ν⁺) of (11), at least 0: what a new node is worth; a failure is worth as much less."""
    delta: float = 0.1
    """δ of IV-C.2, at least 0, metres: joint motions closer than this at every step count as one."""
    wide: int = 4
    """H of (9) where nothing is planned, at least ``narrow``."""
    narrow: int = 1
    """H where all but the last agent are planned, at least 1."""
    children: int = 4
    """K of (10), at least 1: how many of the feasible candidates of an expansion become nodes."""
    few_samples: int = 64
    """How many trajectories an expansion optimises where nothing is planned, at least 1."""
    many_samples: int = 128
    """The same where all but the last agent are planned, at least ``few_samples``."""
    tries: int = 3
    """How often one node is expanded by one agent, at least 1."""
    expansions: int = 20
    """The budget for each agent of the mission, at least 1."""
    improvement: int = 0
    """Further expansions after the first solution, at least 0."""
    printed: bool = False
    """Whether (9), the choice among solutions and the pruning are as printed: the cost in (9) is not divided by the
    number of agents, a solution is chosen by (9) and not by its cost, and nodes like one that failed are closed."""

    def __post_init__(self) -> None:
        sound = {
            "eta": self.eta >= 0,
            "gamma": 0 < self.gamma < 1,
            "reward": self.reward >= 0,
            "delta": self.delta >= 0,
            "wide": self.wide >= self.narrow,
            "narrow": self.narrow >= 1,
            "children": self.children >= 1,
            "few_samples": self.few_samples >= 1,
            "many_samples": self.many_samples >= self.few_samples,
            "tries": self.tries >= 1,
            "expansions": self.expansions >= 1,
            "improvement": self.improvement >= 0,
        }
        for name, holds in sound.items():
            if not holds:
                raise ValueError(f"the search cannot use {name} = {getattr(self, name)}")


PAPER = SearchSettings(few_samples=200, many_samples=800, children=800, printed=True, eta=0.01)
"""As many trajectories as scenarios 1 and 2 optimise at once, shared by the nodes of a round; scenario 3 takes 1000.
Each that is feasible makes a node.

Source:
    [clot] V-A.1.
"""

FSOT = SearchSettings(wide=1, narrow=1, children=1, tries=1)
"""One motion for each agent, never taken back; with ``planning_sequence.in_order``, the ablation with a fixed sequence.

Source:
    [clot] V-A.3, baseline (II).
"""
