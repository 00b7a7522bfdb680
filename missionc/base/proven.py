"""Optimality gap: what a plan comes to beside a proven lower bound of what every plan of the mission does."""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass

SAME = {"s": 1e-6, "m": 1e-3}
"""What a plan comes to and what every plan does are the same where they differ by no more, in their unit."""

OBJECTIVE = {"s": "duration", "m": "distance"}


TOURS, COVER = "tours", "cover"
"""What shows a bound: tours of where agents have to be, which anybody can work out from the mission; or a cover."""


@dataclass(frozen=True, slots=True)
class Proven:
    """A plan lasts, or its agents travel, ``value``; every plan of the mission at least ``least``.

    Args:
        unit: of both: ``s`` of ``minimize duration``, ``m`` of ``minimize distance``.
        by: ``TOURS`` or ``COVER``.
    """

    value: float
    least: float
    unit: str
    by: str

    @property
    def best(self) -> bool:
        """Whether no plan is better."""
        return self.value - self.least <= SAME[self.unit]

    def __str__(self) -> str:
        plan = f"{OBJECTIVE[self.unit]} {self.value:.6g} {self.unit}"
        if self.best:
            return f"{plan}, optimal"
        gap = 1 - self.least / self.value
        return f"{plan}, lower bound {self.least:.6g} {self.unit}, optimality gap {100 * gap:.3g} %"

    def as_record(self) -> dict[str, object]:
        return {"value": self.value, "least": self.least, "unit": self.unit, "by": self.by}
