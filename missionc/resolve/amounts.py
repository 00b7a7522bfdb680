"""An amount: the value of a quantity, a linear expression in SI units with the exponents of its unit."""

from __future__ import annotations

from typing import TypeAlias

from missionc import ir
from missionc.base.late_dataclass import dataclass

Powers: TypeAlias = tuple[int, int, int, int]
"""The exponents of length, time, angle and steps."""

PLAIN: Powers = (0, 0, 0, 0)
"""The dimension of a number without a unit."""


@dataclass(frozen=True, slots=True)
class Amount:
    """``constant + sum(weight * feature)`` in SI units, and the exponents of its unit."""

    constant: float
    powers: Powers = PLAIN
    terms: tuple[tuple[float, ir.Feature], ...] = ()
