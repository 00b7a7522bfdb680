"""Double integrator: the acceleration is constant within each step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from missionc.base.units import Dimension
from missionc.ir.dynamics.kind import Dynamics, Limit


@dataclass(frozen=True, slots=True)
class DoubleIntegrator(Dynamics):
    """Double-integrator dynamics: constant acceleration within a step, up to ``acceleration`` m/s²; speed up to
    ``speed`` m/s."""

    word: ClassVar[str] = "double_integrator"
    limits: ClassVar[tuple[Limit, ...]] = (Limit("acceleration", Dimension.ACCELERATION, "the acceleration"),)
    has_momentum: ClassVar[bool] = True

    speed: float
    acceleration: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> DoubleIntegrator:
        return cls(fastest, *limits)

    @property
    def top_speed(self) -> float:
        return self.speed

    @property
    def top_acceleration(self) -> float:
        return self.acceleration

    def at_most(self, speed: float, acceleration: float) -> DoubleIntegrator:
        return DoubleIntegrator(min(self.speed, speed), min(self.acceleration, acceleration))
