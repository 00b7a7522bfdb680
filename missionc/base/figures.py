"""Numbers in words: counts of things, and decimals that do not hide small values."""

from __future__ import annotations

import math

DECIMALS = 3


def counted(number: int, noun: str) -> str:
    """Count as text: ``1 agent``, ``3 agents``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def decimals(value: float) -> str:
    """Decimals as text: ``0.018``; the first digit of smaller values, ``-0.0004``, and 0 without a sign."""
    if value == 0 or not math.isfinite(value) or round(value, DECIMALS):
        return f"{value + 0.0:.{DECIMALS}f}"
    return f"{value:.1g}"
