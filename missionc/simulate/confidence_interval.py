"""Confidence intervals of a fraction: a count of successes, and the bounds of the true share."""

from __future__ import annotations

import math
from dataclasses import dataclass

NORMAL_95 = 1.959963984540054
"""The standard normal distribution lies within plus and minus this with a probability of 95 %."""


@dataclass(frozen=True, slots=True)
class Fraction:
    """``held`` of ``flights``; the true share is from ``low`` to ``high`` with a confidence of 95 %."""

    held: int
    flights: int
    low: float
    high: float

    @property
    def share(self) -> float:
        return self.held / self.flights


def fraction(held: int, flights: int) -> Fraction:
    """Wilson's score interval, of use for few flights and for shares near 0 and 1 too.

    Raises:
        ValueError: there are no flights, or not so many.

    Source:
        Wilson, "Probable Inference, the Law of Succession, and Statistical Inference" (1927).
    """
    if not 0 <= held <= flights or flights == 0:
        raise ValueError(f"{held} of {flights} flights")
    share, square = held / flights, NORMAL_95**2
    middle = (share + square / (2 * flights)) / (1 + square / flights)
    spread = NORMAL_95 / (1 + square / flights) * math.sqrt(share * (1 - share) / flights + square / (4 * flights**2))
    # At the ends the bound is exact; rounding may miss it by a hair.
    low = 0.0 if held == 0 else max(0.0, middle - spread)
    high = 1.0 if held == flights else min(1.0, middle + spread)
    return Fraction(held, flights, low, high)
