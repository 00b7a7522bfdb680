"""Plain numbers: decimal notation shared by the file formats of other programs."""

from __future__ import annotations

import math
import re
from typing import TypeGuard

_PLAIN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def plain_number(text: str) -> float:
    """Number that a text denotes; NaN if the text is not a finite decimal number in ASCII digits."""
    value = float(text) if _PLAIN.fullmatch(text) else math.nan
    return value if math.isfinite(value) else math.nan


def is_number(value: object) -> TypeGuard[int | float]:
    """Return true if a JSON value is a finite number; ``true`` and ``false`` are not numbers."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
