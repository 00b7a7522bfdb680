"""SAT problem: agents to plan, formulas, and reservations of planned agents."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower import Lowered, lower
from missionc.backends.smt.encode.lower_motion import Motion, lower_motion
from missionc.backends.smt.encode.occupancy import Occupancy
from missionc.backends.smt.refine.lazy_constraints import LazyConstraints
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.work import CLAUSE
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Goal


class Problem(Record, eq=False):
    """SAT problem with its variables and its search; ``lowered`` has a literal for each goal."""

    motion: Motion
    lowered: Lowered
    search: LazyConstraints


class Setting(Record, eq=False):
    """Data and limits that all problems of a run share."""

    mission: Mission
    budget: Budget
    account: Account
    clauses: int
    """Maximum number of clauses for formulas and motions; collision clauses may exceed it, up to the budget's limit."""

    def problem(
        self,
        goals: Sequence[Goal],
        roadmaps: tuple[Roadmap, ...],
        ways: tuple[Flags, ...],
        planned: frozenset[int],
        reserved: frozenset[int],
        most_links: int,
        solvers: Solvers,
    ) -> Problem:
        """SAT problem of some agents and goals, with the search that queries the solvers.

        Args:
            roadmaps: roadmaps with the allowed moves of the planned agents.
            ways: possible states of each agent, (steps + 1, states).
            planned: agents to plan.
            reserved: agents with one fixed motion each, out of reach of the planned agents' moves.
            most_links: maximum number of links of a route.

        Raises:
            TooLarge: the clauses would exceed their limit.
            Unexpressible: a predicate depends on too many agents at once.
        """
        with self.account.stage("lower"):
            clauses = Clauses(self.clauses)
            solvers.begin()
            motion = lower_motion(roadmaps, ways, planned | reserved, clauses)
            solvers.show(clauses)
            lowered = lower(
                goals, Labels(self.mission, roadmaps), motion, clauses, Occupancy(motion, clauses), most_links
            )
            self.account.work += CLAUSE * clauses.count
            clauses.limit = self.budget.limits.clauses
        members = np.array(sorted(planned), dtype=np.int64)
        search = LazyConstraints(self.mission, motion, members, clauses, solvers, self.account, self.budget.on_progress)
        return Problem(motion, lowered, search)
