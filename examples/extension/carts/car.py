"""A car with bounded steering: `dynamics car(speed 0.3..1 m/s, steering <= 30 deg, wheelbase <= 0.3 m)`.

A car on a circle of radius `wheelbase / tan(steering)` turns by `speed / radius` each second. A plan bounds the turn of
every step by that of the slowest step, so that the car can follow each one.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from missionc.extension import Dimension, Dynamics, Limit, Unfit


@dataclass(frozen=True)
class Car(Dynamics):
    word: ClassVar[str] = "car"
    limits: ClassVar[tuple[Limit, ...]] = (
        Limit("steering", Dimension.ANGLE, "the steering angle"),
        Limit("wheelbase", Dimension.LENGTH, "the wheelbase"),
    )
    may_be_restless: ClassVar[bool] = True
    faces_ahead: ClassVar[bool] = True

    slowest: float
    fastest: float
    steering: float
    wheelbase: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> "Car":
        if slowest == 0:
            raise Unfit("a car that stands still cannot turn; write a lowest speed above 0")
        if limits[0] >= math.pi / 2:
            raise Unfit("the steering angle must be below 90 deg")
        return cls(slowest, fastest, *limits)

    @property
    def lowest_speed(self) -> float:
        return self.slowest

    @property
    def top_speed(self) -> float:
        return self.fastest

    @property
    def top_turn(self) -> float:
        return self.slowest * math.tan(self.steering) / self.wheelbase

    def at_most(self, speed: float, acceleration: float) -> "Car":
        return replace(self, fastest=min(self.fastest, speed)) if self.slowest < speed else self
