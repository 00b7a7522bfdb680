"""Confidence bounds of a fraction: the number of successes to the bounds of the true share."""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Fraction:
    """``held`` of ``flights``, and exact bounds of the true share with a confidence of 95 %.

    ``least`` is the one-sided lower bound, for "at least". ``low`` and ``high`` are the two-sided interval.
    """

    held: int
    flights: int
    least: float
    low: float
    high: float

    @property
    def share(self) -> float:
        return self.held / self.flights


def fraction(held: int, flights: int) -> Fraction:
    """Exact (Clopper–Pearson) bounds: each covers the true share with at least its confidence, however few the flights.

    Raises:
        ValueError: there are no flights, or not so many.

    Source:
        Clopper and Pearson, "The Use of Confidence or Fiducial Limits Illustrated in the Case of the Binomial" (1934).
    """
    if not 0 <= held <= flights or flights == 0:
        raise ValueError(f"{held} of {flights} flights")
    from scipy.special import betaincinv  # takes a while to load, and few commands count flights

    def above(doubt: float) -> float:
        return float(betaincinv(held, flights - held + 1, doubt)) if held else 0.0

    doubt = 1 - CONFIDENCE
    high = float(betaincinv(held + 1, flights - held, 1 - doubt / 2)) if held < flights else 1.0
    return Fraction(held, flights, above(doubt), above(doubt / 2), high)
