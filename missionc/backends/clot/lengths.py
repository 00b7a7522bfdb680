"""Routes bounded in metres: judged exactly by the monitor's own search, one candidate after the other."""

from __future__ import annotations

import numpy as np
from torch import Tensor

from missionc.backends.clot.cost_graph import Length
from missionc.backends.clot.leaves import UNLIMITED
from missionc.backends.clot.states import States, Team
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import ROBUSTNESS
from missionc.plan import Trace


def length_value(term: Length, team: Team, states: States, parts: tuple[Tensor, ...]) -> Tensor:
    """The robustness of a route with a length, (batch, agents, steps), metres; it has no gradient.

    Args:
        parts: the values of ``through`` and ``end``, where it has them.
    """
    batch, agents, steps, _ = states.position.shape
    position = states.position.detach().cpu().double().numpy()
    given = [part.detach().expand(batch, agents, steps).cpu().double().numpy() for part in parts]
    values = []
    for row in range(batch):
        trace = Trace(team.mission.step, position[row], np.zeros_like(position[row]), np.zeros(position.shape[1:3]))
        evaluation = Evaluation(ROBUSTNESS, team.mission, trace)
        values.append(evaluation.value(term.node, tuple(part[row] for part in given)))
    value = states.position.new_tensor(np.clip(np.stack(values), -UNLIMITED, UNLIMITED))
    return value if term.holds else -value
