"""The single integrator: a new velocity at every step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from missionc.ir.dynamics.kind import Dynamics


@dataclass(frozen=True, slots=True)
class SingleIntegrator(Dynamics):
    """Constant velocity within a step, up to ``speed`` m/s."""

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
    """First-order dynamics with only a maximum speed, m/s: a relaxation of other dynamics."""
    return SingleIntegrator(speed)
