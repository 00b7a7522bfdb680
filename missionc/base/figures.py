"""Numbers as text: counts with nouns, and decimal numbers that do not round small values to 0."""

from __future__ import annotations

import math

DECIMALS = 3


def counted(number: int, noun: str) -> str:
    """Count and noun as text: ``1 agent``, ``3 agents``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def decimals(value: float) -> str:
    """Decimal number as text, ``0.018``; smaller values have one significant digit, ``-0.0004``, and 0 has no sign."""
    if value == 0 or not math.isfinite(value) or round(value, DECIMALS):
        return f"{value + 0.0:.{DECIMALS}f}"
    return f"{value:.1g}"
