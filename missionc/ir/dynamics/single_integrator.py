"""Single integrator: the velocity is constant within each step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from missionc.ir.dynamics.kind import Dynamics


@dataclass(frozen=True, slots=True)
class SingleIntegrator(Dynamics):
    """Single-integrator dynamics: constant velocity within a step, up to ``speed`` m/s."""

    word: ClassVar[str] = "single_integrator"

    speed: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> SingleIntegrator:
        return cls(fastest)

    @property
    def top_speed(self) -> float:
        return self.speed

    def at_most(self, speed: float, acceleration: float) -> SingleIntegrator:
        return SingleIntegrator(min(self.speed, speed))


def of_first_order(speed: float) -> SingleIntegrator:
    """Single-integrator dynamics with only a maximum speed, m/s; used as a relaxation of other dynamics."""
    return SingleIntegrator(speed)
