"""Unicycle: speed and heading are constant within each step, and the agent moves along its heading."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from missionc.base.units import Dimension
from missionc.ir.dynamics.kind import Dynamics, Limit


@dataclass(frozen=True, slots=True)
class Unicycle(Dynamics):
    """Unicycle dynamics: straight motion along the heading within a step, and turns in place between steps.

    The speed is between ``slowest`` and ``fastest`` m/s; the agent can wait only if ``slowest`` is 0. ``turn`` (rad/s)
    bounds the change of heading between steps; ``math.inf`` if the mission sets no bound.

    Source:
        [strel] Experiment Setup.
    """

    word: ClassVar[str] = "unicycle"
    limits: ClassVar[tuple[Limit, ...]] = (Limit("turn", Dimension.TURN, "the turning rate", math.inf),)
    may_be_restless: ClassVar[bool] = True
    faces_ahead: ClassVar[bool] = True

    slowest: float
    fastest: float
    turn: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> Unicycle:
        return cls(slowest, fastest, *limits)

    @property
    def lowest_speed(self) -> float:
        return self.slowest

    @property
    def top_speed(self) -> float:
        return self.fastest

    @property
    def top_turn(self) -> float:
        return self.turn

    def at_most(self, speed: float, acceleration: float) -> Unicycle:
        return replace(self, fastest=min(self.fastest, speed)) if self.slowest < speed else self
