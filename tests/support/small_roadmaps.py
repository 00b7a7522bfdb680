"""Roadmaps of a few places, goals of agents on them, and answers of a solver."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from missionc import ir
from missionc.backends.api import ignore
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower import Lowered, lower
from missionc.backends.smt.encode.lower_motion import Motion, Occupancy, all_ways, lower_motion
from missionc.backends.smt.refine.lazy_constraints import LazyConstraints
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.ir.kernel.nodes import Goal, Node
from tests.support.legal_plans import SPAN


def roadmap_of(agents: tuple[int, ...], places: Sequence[tuple[float, ...]], steps: int) -> Roadmap:
    """Roadmap on which every place is reachable from every other in one step, and a start and finish."""
    count = len(places)
    moves = np.array([(one, other) for one in range(count) for other in range(count)])
    everywhere = np.arange(count)
    return Roadmap(
        agents=agents,
        position=np.array(places),
        velocity=np.zeros((count, 2)),
        heading=np.full(count, np.nan),
        moves=moves,
        standing=np.ones((steps + 1, count), dtype=bool),
        allowed=np.ones((steps, len(moves)), dtype=bool),
        starts=(everywhere,) * len(agents),
        finishes=(everywhere,) * len(agents),
    )


@dataclass(frozen=True)
class Asked:
    """Clauses about agents on roadmaps. Joint motions are states, (agents, steps + 1)."""

    mission: ir.Mission
    motion: Motion
    clauses: Clauses
    lowered: Lowered

    def fixed(self, states: Sequence[Sequence[int]]) -> tuple[int, ...]:
        """Literals for a given motion of the agents."""
        return tuple(
            int(self.motion.states[agent][step, state])
            for agent, row in enumerate(states)
            for step, state in enumerate(row)
        )

    @contextmanager
    def search(self, solver: str = "z3", seconds: float = 60.0) -> Iterator[LazyConstraints]:
        with Solvers(solver, 2 << 30, 0, time.monotonic() + seconds) as solvers:
            solvers.begin()
            everyone = np.arange(len(self.mission.agents))
            yield LazyConstraints(self.mission, self.motion, everyone, self.clauses, solvers, Account(), ignore)


def asked(mission: ir.Mission, roadmaps: tuple[Roadmap, ...], *goals: Node, most_links: int = 99) -> Asked:
    """Clauses of all agents on these roadmaps, each goal with a literal of its own."""
    clauses = Clauses(10_000_000)
    motion = lower_motion(roadmaps, all_ways(roadmaps, {}), frozenset(range(len(mission.agents))), clauses)
    named = [Goal(f"goal{number}", goal, SPAN) for number, goal in enumerate(goals)]
    return Asked(
        mission,
        motion,
        clauses,
        lower(named, Labels(mission, motion.roadmaps), motion, clauses, Occupancy(motion, clauses), most_links),
    )
