"""Comparison of a JSON document with a recomputed one: the path of the first difference.

Texts, booleans and integers must be equal; numbers with a fraction may differ by rounding between machines.
"""

from __future__ import annotations

import math
import re
from typing import TypeGuard

from missionc.base.strict_json import is_finite_number

SAME = 1e-8
"""Maximum difference of two numbers that count as equal, relative for numbers above 1, for rounding between
machines.
"""

FRACTION = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e[+-]\d+")
"""Pattern of a number with a fraction or an exponent, in Python's format."""

VERSION = re.compile(r"[0-9A-Za-z.+!_-]{1,64}")
"""Pattern of a text that may be the version of a package."""

LONGEST = 40
"""Maximum number of characters that a message quotes of a text."""


def difference(read: object, computed: object, place: str = "", same: float = SAME) -> str | None:
    """Describe the first difference between two JSON documents; None if there is none.

    Args:
        place: path of the value in the complete document, such as ``agents[0].radius``.
        same: maximum difference of numbers with a fraction, relative above 1.
    """
    match computed:
        case dict():
            return _of_records(read, computed, place, same)
        case list():
            return _of_lists(read, computed, place, same)
        case float() if is_finite_number(read) and close(read, computed, same):
            return None
        case int() | str() | None if type(read) is type(computed) and read == computed:
            return None
        case _:
            return f"{_named(place)} is {shown(read)}, but the files give {shown(computed)}"


def close(read: float, computed: float, same: float = SAME) -> bool:
    """Return whether two numbers differ at most by rounding."""
    return abs(read - computed) <= same * max(1.0, abs(computed))


def same_text(read: str, computed: str) -> bool:
    """Return whether two texts are equal up to rounding of numbers with a fraction."""
    if read == computed:
        return True
    if FRACTION.split(read) != FRACTION.split(computed):
        return False
    numbers = zip(map(float, FRACTION.findall(read)), map(float, FRACTION.findall(computed)), strict=True)
    return all(math.isfinite(one) and math.isfinite(other) and close(one, other) for one, other in numbers)


def shown(value: object) -> str:
    """Short text for a JSON value in a message, such as ``a list of 3``."""
    match value:
        case dict():
            return "a record"
        case list():
            return f"a list of {len(value)}"
        case None | bool():
            return {None: "null", True: "true", False: "false"}[value]
        case float():
            return f"{value:.9g}"
        case _:
            text = str(value)
            return f"`{text if len(text) <= LONGEST else text[: LONGEST - 1] + '…'}`"


def _of_records(read: object, computed: dict[str, object], place: str, same: float) -> str | None:
    if not isinstance(read, dict):
        return f"{_named(place)} is {shown(read)}, not a record"
    for key in computed:
        if key not in read:
            return f"{_named(place)} has no `{key}`"
    for key in read:
        if key not in computed:
            return f"{_named(place)} has an unexpected key {shown(key)}"
    differences = (
        difference(read[key], value, f"{place}.{key}" if place else key, same) for key, value in computed.items()
    )
    return next((each for each in differences if each is not None), None)


def _of_lists(read: object, computed: list[object], place: str, same: float) -> str | None:
    if not isinstance(read, list):
        return f"{_named(place)} is {shown(read)}, not a list"
    if len(read) != len(computed):
        return f"{_named(place)} has {len(read)} entries, but the files give {len(computed)}"
    pairs = enumerate(zip(read, computed, strict=True))
    differences = (difference(one, other, f"{place}[{number}]", same) for number, (one, other) in pairs)
    return next((each for each in differences if each is not None), None)


def _named(place: str) -> str:
    return f"its `{place}`" if place else "it"


def is_version(value: object) -> TypeGuard[str]:
    """Return whether a value may be the version of a package."""
    return isinstance(value, str) and VERSION.fullmatch(value) is not None
