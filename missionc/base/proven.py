"""Optimality gap: value of a plan next to a proven lower bound for every plan of the mission."""

from __future__ import annotations

from missionc.base.late_dataclass import Record

SAME = {"s": 1e-6, "m": 1e-3}
"""Tolerance for a plan's value and the bound to count as equal, in their unit."""

OBJECTIVE = {"s": "duration", "m": "distance"}


TOURS, COVER = "tours", "cover"
"""Sources of a bound: tours of required places, which anyone can compute from the mission, or a cover."""


class Proven(Record):
    """Value of a plan (duration or total distance), and the lower bound ``least`` for every plan of the mission.

    Args:
        unit: unit of both: ``s`` for ``minimize duration``, ``m`` for ``minimize distance``.
        by: ``TOURS`` or ``COVER``.
    """

    value: float
    least: float
    unit: str
    by: str

    @property
    def best(self) -> bool:
        """True if no plan is better."""
        return self.value - self.least <= SAME[self.unit]

    def __str__(self) -> str:
        plan = f"{OBJECTIVE[self.unit]} {self.value:.6g} {self.unit}"
        if self.best:
            return f"{plan}, optimal"
        gap = 1 - self.least / self.value
        return f"{plan}, lower bound {self.least:.6g} {self.unit}, optimality gap {100 * gap:.3g} %"

    def as_record(self) -> dict[str, object]:
        return {"value": self.value, "least": self.least, "unit": self.unit, "by": self.by}
