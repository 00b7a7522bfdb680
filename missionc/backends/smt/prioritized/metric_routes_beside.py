"""Routes in metres beside planned agents: states of one agent in which formulas over them are true.

Planned agents follow their trajectories, and all others are far away. The monitor's own functions evaluate the
formulas, so that nothing is rounded.
"""

from __future__ import annotations

import numpy as np

from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Flags, Trace
from missionc.ir.kernel.analysis import reads_lengths, steps_ahead
from missionc.ir.kernel.nodes import At, Atom, Node
from missionc.ir.kernel.walk import postorder
from missionc.planning.progression.residuals import TooComplex
from missionc.verification.monitoring.monitor import truths


def is_measured(node: Node) -> bool:
    """Return true if the formula or a subformula reads lengths in metres."""
    return any(map(reads_lengths, postorder((node,))))


def holds_beside(node: Node, agent: int, reservations: Reservations, labels: Labels, may: Flags) -> Flags:
    """Steps and states of the agent, within ``may``, in which the formula is true: (steps + 1, states).

    Raises:
        TooComplex: the formula is about other steps, or names agents that are not planned.
    """
    away = 1e12  # metres to agents without a path, and between them; no link is that long
    present = {agent, *reservations.agents}
    for part in postorder((node,)):
        unknown = isinstance(part, At) and part.agent not in present
        unknown |= isinstance(part, Atom) and not labels.of_places(part.predicate)
        if unknown:
            raise TooComplex
    if steps_ahead((node,))[node]:
        raise TooComplex
    mission, motion = labels.mission, reservations.motion
    step, state = np.nonzero(may)
    position = np.full((motion.agents, len(step), mission.dimension), away)
    position[:, :, 0] *= np.arange(1, motion.agents + 1)[:, None]
    for other in reservations.agents:
        position[other] = motion.roadmap(other).position[reservations.states[other]][step]
    position[agent] = motion.roadmap(agent).position[state]
    trace = Trace(mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))
    found = np.zeros(may.shape, dtype=np.bool_)
    found[step, state] = truths((node,), mission, trace)[node][agent]
    return found
