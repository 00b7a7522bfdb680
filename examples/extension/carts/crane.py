"""A crane that moves along x or along y, never along both: `dynamics crane(speed <= 1 m/s)`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from missionc.extension import Dynamics


@dataclass(frozen=True)
class Crane(Dynamics):
    word: ClassVar[str] = "crane"
    rules: ClassVar[tuple[str, ...]] = ("one axis",)

    fastest: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> "Crane":
        return cls(fastest)

    @property
    def top_speed(self) -> float:
        return self.fastest

    def at_most(self, speed: float, acceleration: float) -> "Crane":
        return Crane(min(self.fastest, speed))

    def step_margins(self, position: Any, heading: Any, step: float) -> Mapping[str, tuple[Any, str]]:
        aside = np.abs(np.diff(position, axis=0)).min(axis=1)  # metres along the other axis, of each step
        return {"one axis": (1e-6 - aside, "m")}
