"""Single-agent search: the shortest path on which all holds that is asked of one agent, around the reservations.

For what is asked at once, throughout a window or at some time in it, of the place
where the agent is: then each place at each step is open to it or not, and no solver
is needed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.backends.smt.encode.clauses import TRUE, Clauses
from missionc.backends.smt.encode.lower import Formulas, deep
from missionc.backends.smt.encode.lower_motion import lower_motion
from missionc.backends.smt.encode.occupancy import Occupancy
from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.refine.problem import LINKS
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.base.trace import Flags
from missionc.ir import Mission
from missionc.kernel.analysis import conjuncts
from missionc.kernel.nodes import Node
from missionc.kernel.walk import awaited, children

ERRANDS = 3
"""So many places to visit at most; the work doubles with each."""


class SingleAgentSearch:
    """Shortest paths of single agents among others, who are where ``reservations`` says: ``agents``.

    What those who are settled later do for others is not seen.
    """

    def __init__(self, reservations: Reservations, ways: tuple[Flags, ...], mission: Mission, limit: int) -> None:
        motion = reservations.motion
        clauses = Clauses(limit)  # what is known needs none
        known = lower_motion(motion.roadmaps, reservations.fixed(ways), frozenset(reservations.agents), clauses)
        self.agents = list(reservations.agents)
        self._ways, self._motion = ways, motion
        self._formulas = Formulas(mission, known, clauses, Occupancy(known, clauses), LINKS)

    def way(
        self, agent: int, formulas: Sequence[Node], reservations: Reservations, *, pushing: bool = False
    ) -> Indices | None:
        """The shortest way, (steps + 1,), clear of all who are settled by now, or ``pushing`` few of them.

        None where there is none, or where the formulas ask for more than this can look for.
        """
        ways, errands = self._ways[agent].copy(), []
        for conjunct in conjuncts(formulas):
            node, steps, event = conjunct.formula, conjunct.steps, awaited(conjunct.formula)
            if conjunct.agent != agent or steps is None:
                return None
            if event and not conjunct.windows and children(node) == (event.node,) and self._decides(event.node):
                errand = np.zeros_like(ways)
                errand[event.steps] = self._holds(event.node, agent)[event.steps]
                errands.append(errand)
            elif self._decides(node):
                ways[steps] &= self._holds(node, agent)[steps]
            else:
                return None
        return reservations.shortest(agent, ways, errands, pushing=pushing) if len(errands) <= ERRANDS else None

    def _decides(self, body: Node) -> bool:
        return self._formulas.places.decides(body)

    def _holds(self, body: Node, agent: int) -> Flags:
        """The steps and states at which it holds of the agent for certain, (steps + 1, states)."""
        able = self._ways[agent]
        step, state = np.nonzero(able)
        holds = np.zeros_like(able)
        with deep():
            place = state + self._motion.places_of(agent).start
            holds[step, state] = self._formulas.places.standing(body, agent, step, place) == TRUE
        return holds
