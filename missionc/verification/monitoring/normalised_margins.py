"""Normalised margins of requirements: robustness with every margin divided by its natural scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missionc.base.trace import Trace
from missionc.geometry.natural_scale import natural_scale
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.kernel.nodes import Goal
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS, Values


def normalised_margins(mission: Mission, goals: tuple[Goal, ...], trace: Trace) -> dict[str, float]:
    """Normalised margin of each goal on a trace, by the goal's name.

    Goals that no motion can change are left out.

    Source:
        [clot] II-B, of margins that are divided by ``natural_scale``.
    """
    values = _Normalised(mission, trace).values([goal.formula for goal in goals])
    found = {goal.name: float(values[goal.formula][0, 0]) for goal in goals}
    return {name: value for name, value in found.items() if np.isfinite(value)}


class _Normalised(Evaluation):
    """Evaluation of robustness with every margin divided by its natural scale."""

    def __init__(self, mission: Mission, trace: Trace) -> None:
        def scaled(predicate: Predicate, margins: Values) -> Values:
            scale = natural_scale(predicate, mission)
            return np.where(margins < 0, -np.inf, np.inf) if np.isinf(scale) else margins / max(scale, 1e-9)

        super().__init__(replace(ROBUSTNESS, of_predicate=scaled), mission, trace)

    def links_of(self, graph: Graph, piece: slice) -> Values:
        return super().links_of(graph, piece) / float(graph.radius)
