"""Robustness of formulas on motions of the optimiser: positions and velocities, of any number of steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missionc.backends.clot.cost_graph.cost_graph import SignedPredicate
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Beacon, Mission, Predicate
from missionc.ir.language.margins.headings import of_velocity
from missionc.ir.language.margins.predicate_margins import AlongTrace
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS


class ConditionValues(Evaluation):
    """Domain of values on given positions and velocities, (agents, steps, dim), metres and m/s.

    A value is (agents, steps), or 1 for either axis, metres. Partial motions have no past: predicates about it, and
    their negations, are infinite.

    Args:
        ruled_out: predicates or negations with value ``-inf``, (agents, steps), since the opposite has to hold.
    """

    def __init__(
        self,
        mission: Mission,
        position: Array,
        velocity: Array,
        ruled_out: Mapping[SignedPredicate, Flags] | None = None,
    ) -> None:
        motion = Trace(mission.step, position, velocity, np.zeros(position.shape[:2]))
        super().__init__(ROBUSTNESS, mission, motion)
        self.view, self.ruled_out = _InMotion(mission, motion), ruled_out or {}

    def atom(self, predicate: Predicate, holds: bool) -> Array:
        if predicate.reads_past and self.steps != self.mission.steps + 1:
            return np.full((1, 1), np.inf)
        value: Array = super().atom(predicate, holds)
        out = self.ruled_out.get((predicate, holds))
        if out is None:
            return value
        return np.where(out if len(value) > 1 else out.any(axis=0, keepdims=True), -np.inf, value)


class _InMotion(AlongTrace):
    """View of agents that face in the direction of their motion."""

    def facing(self, towards: float | Beacon, within: float) -> Array:
        return np.asarray(of_velocity(np, self.own(), self.velocity(), towards, within))
