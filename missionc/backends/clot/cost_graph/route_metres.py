"""Robustness of routes bounded in metres, by the monitor's own search on the graph."""

from __future__ import annotations

import numpy as np
from torch import Tensor

from missionc.backends.clot.cost_graph.cost_graph import Length
from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.cost_graph.motion_batch import States, Team
from missionc.base.trace import Array, Trace
from missionc.kernel.nodes import All, Route
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import ROBUSTNESS


def length_value(term: Length, team: Team, states: States, parts: tuple[Tensor, ...]) -> Tensor:
    """The robustness of a route with a length, (batch, agents, steps), metres; it has no gradient.

    Args:
        parts: the values of ``through`` and ``end``.
    """
    batch, agents, steps, dim = states.position.shape
    sign = 1.0 if term.holds else -1.0
    position = _numbers(states.position).reshape(agents, -1, dim)
    given = [sign * _numbers(part.expand(batch, agents, steps)).reshape(agents, -1) for part in parts]
    trace = Trace(team.mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))
    route = Route(term.graph, All(()), All(()), term.low, term.high)
    value = Evaluation(ROBUSTNESS, team.mission, trace).route(route, *given)
    value = sign * np.clip(value, -UNLIMITED, UNLIMITED).reshape(agents, batch, steps).swapaxes(0, 1)
    return states.position.new_tensor(value)


def _numbers(value: Tensor) -> Array:
    """(batch, agents, ...) -> (agents, batch, ...)."""
    return value.detach().cpu().double().numpy().swapaxes(0, 1)
