"""Units of measurement and their physical dimensions.

Plain numbers: decimal notation shared by the file formats of other programs.
"""

from __future__ import annotations

import math
import re
from enum import Enum
from typing import NewType, TypeGuard

Seconds = NewType("Seconds", float)
Metres = NewType("Metres", float)
Steps = NewType("Steps", int)
Hops = NewType("Hops", int)


class Metric(Enum):
    """Measure of the length of a communication route: hops, metres or the sum of link weights."""

    HOPS = "hops"
    METRES = "distance"
    WEIGHT = "weight"


class Dimension(Enum):
    """Physical dimension of a quantity; the value is its name in messages."""

    NUMBER = "a plain number"
    LENGTH = "a length"
    TIME = "a time"
    SPEED = "a speed"
    ACCELERATION = "an acceleration"
    JERK = "a jerk"
    ANGLE = "an angle"
    TURN = "a turning rate"
    STEPS = "a number of steps"


UNITS: dict[str, tuple[Dimension, float]] = {
    "ms": (Dimension.TIME, 1e-3),
    "s": (Dimension.TIME, 1.0),
    "min": (Dimension.TIME, 60.0),
    "mm": (Dimension.LENGTH, 1e-3),
    "cm": (Dimension.LENGTH, 1e-2),
    "m": (Dimension.LENGTH, 1.0),
    "km": (Dimension.LENGTH, 1e3),
    "rad": (Dimension.ANGLE, 1.0),
    "deg": (Dimension.ANGLE, math.pi / 180),
    "m/s": (Dimension.SPEED, 1.0),
    "m/s^2": (Dimension.ACCELERATION, 1.0),
    "m/s^3": (Dimension.JERK, 1.0),
    "rad/s": (Dimension.TURN, 1.0),
    "deg/s": (Dimension.TURN, math.pi / 180),
    "steps": (Dimension.STEPS, 1.0),
}
"""Dimension of each unit, and its size in SI units."""


_PLAIN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def plain_number(text: str) -> float:
    """Number that a text denotes; NaN if the text is not a finite decimal number in ASCII digits."""
    value = float(text) if _PLAIN.fullmatch(text) else math.nan
    return value if math.isfinite(value) else math.nan


def is_number(value: object) -> TypeGuard[int | float]:
    """Return true if a JSON value is a finite number; ``true`` and ``false`` are not numbers."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
