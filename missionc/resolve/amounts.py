"""An amount: the value of a quantity, a linear expression in SI units with the exponents of its unit.

Numbers are what is written, to the last decimal, and so is what arithmetic makes of them: 0.1 * 3 is 0.3. They are
rounded once, where a ``float`` is asked for.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TypeAlias

from missionc import ir
from missionc.base.late_dataclass import dataclass

Powers: TypeAlias = tuple[int, int, int, int]
"""The exponents of length, time, angle and steps."""

PLAIN: Powers = (0, 0, 0, 0)
"""The dimension of a number without a unit."""


MOST_BITS = 1 << 11
"""Bits of the divisor of an exact number; one that needs more is rounded to the nearest ``float``."""


@dataclass(frozen=True, slots=True)
class Amount:
    """``exact + sum(weight * feature)`` in SI units, and the exponents of its unit; ``exact`` is None once reported."""

    exact: Fraction | None
    powers: Powers = PLAIN
    terms: tuple[tuple[float, ir.Feature], ...] = ()

    @property
    def constant(self) -> float:
        """The nearest ``float``; NaN where the amount has been reported."""
        return math.nan if self.exact is None else rounded(self.exact)


def as_written(value: float) -> Fraction:
    """The decimal number that a ``float`` was read from."""
    return Fraction(repr(value))


def rounded(value: Fraction) -> float:
    """The nearest ``float``, infinite where there is none so large."""
    try:
        return float(value)
    except OverflowError:
        return math.copysign(math.inf, value)


def kept(value: Fraction) -> Fraction:
    """The number itself, or a rounded one where it would take too much room."""
    return value if value.denominator.bit_length() <= MOST_BITS else as_written(rounded(value))
