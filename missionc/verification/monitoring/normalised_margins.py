"""Normalised margins of plans: the robustness of each requirement with every margin divided by its natural scale."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Trace
from missionc.geometry.natural_scale import natural_scale
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.kernel.nodes import Goal, Kernel
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


class Margins(Record):
    """Normalised margins of a plan, each at most ``most``.

    Args:
        each: margins of the requirements, and the smallest margin of all bodies.
    """

    each: tuple[float, ...]
    most: float

    @staticmethod
    def of(mission: Mission, kernel: Kernel, plan: Trace, bodies: float, most: float) -> Margins:
        """Margins of a plan, each at most ``most``; ``bodies`` is that of separation and clearance."""
        found = normalised_margins(mission, kernel.requirements, plan).values()
        return Margins(tuple(min(most, margin) for margin in (*found, bodies)), most)

    @property
    def least(self) -> float:
        """The smallest margin."""
        return min(self.each)

    @property
    def score(self) -> float:
        """Sum of the square roots: what a narrow margin gains counts more than what a wide one loses."""
        return sum(math.sqrt(max(margin, 0.0)) for margin in self.each)

    @property
    def wide(self) -> bool:
        """True if the smallest margin is nearly ``most``, so that wider ones are not worth a search."""
        nearly = 0.8
        return self.least >= nearly * self.most

    def wider(self, than: Margins, gain: float) -> bool:
        """Return whether the score is larger by this gain at least, and the smallest margin is no smaller."""
        rounding = 1e-9
        return self.score >= than.score + gain and self.least >= than.least - rounding


class _Normalised(Evaluation):
    """Evaluation of robustness with every margin divided by its natural scale."""

    def __init__(self, mission: Mission, trace: Trace) -> None:
        def scaled(predicate: Predicate, margins: Values) -> Values:
            scale = natural_scale(predicate, mission)
            return np.where(margins < 0, -np.inf, np.inf) if np.isinf(scale) else margins / max(scale, 1e-9)

        super().__init__(replace(ROBUSTNESS, of_predicate=scaled), mission, trace)

    def links_of(self, graph: Graph, piece: slice) -> Values:
        return super().links_of(graph, piece) / float(graph.radius)
