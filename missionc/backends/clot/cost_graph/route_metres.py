"""Robustness of routes bounded in metres, by the monitor's own search on the graph."""

from __future__ import annotations

import numpy as np
from torch import Tensor

from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.cost_graph.motion_batch import States, Team
from missionc.base.trace import Array, Trace
from missionc.ir.kernel.nodes import RouteNode
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS


def length_value(node: RouteNode, team: Team, states: States, through: Tensor, end: Tensor) -> Tensor:
    """The robustness of routes with a length, (batch, agents, steps), metres; it has no gradient.

    Args:
        through: the value of the agents on the way, (batch, agents, steps), metres; ``end`` of the last.
    """
    batch, agents, steps, dim = states.position.shape
    position = _numbers(states.position).reshape(agents, -1, dim)
    given = (_numbers(part.expand(batch, agents, steps)).reshape(agents, -1) for part in (through, end))
    trace = Trace(team.mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))
    value = Evaluation(ROBUSTNESS, team.mission, trace).route(node, *given)
    value = np.clip(value, -UNLIMITED, UNLIMITED).reshape(agents, batch, steps).swapaxes(0, 1)
    return states.position.new_tensor(value)


def _numbers(value: Tensor) -> Array:
    """(batch, agents, ...) -> (agents, batch, ...)."""
    return value.detach().cpu().double().numpy().swapaxes(0, 1)
