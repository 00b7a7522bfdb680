"""Optimality gap: objective value of a plan and a proven lower bound for every plan of the mission."""

from __future__ import annotations

from missionc.base.late_dataclass import Record

SAME = {"s": 1e-6, "m": 1e-3}
"""Tolerance, by unit, within which the value of a plan counts as equal to the lower bound."""

OBJECTIVE = {"s": "duration", "m": "distance"}


TOURS, COVER = "tours", "cover"
"""Methods that prove a lower bound: tours of the required regions, or an over-approximation of all motions (cover)."""


class Proven(Record):
    """Objective value of a plan (duration or total distance), and a lower bound ``least`` for every plan of the
    mission.

    Args:
        unit: unit of ``value`` and ``least``: ``s`` for ``minimize duration``, ``m`` for ``minimize distance``.
        by: method that proved the lower bound, ``TOURS`` or ``COVER``.
    """

    value: float
    least: float
    unit: str
    by: str

    @property
    def best(self) -> bool:
        """True if the plan is optimal: its value equals the lower bound within the tolerance."""
        return self.value - self.least <= SAME[self.unit]

    def __str__(self) -> str:
        plan = f"{OBJECTIVE[self.unit]} {self.value:.6g} {self.unit}"
        if self.best:
            return f"{plan}, optimal"
        gap = 1 - self.least / self.value
        return f"{plan}, lower bound {self.least:.6g} {self.unit}, optimality gap {100 * gap:.3g} %"

    def as_record(self) -> dict[str, object]:
        return {"value": self.value, "least": self.least, "unit": self.unit, "by": self.by}
