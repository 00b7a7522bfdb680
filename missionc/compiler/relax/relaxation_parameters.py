"""Relaxation parameters: numbers of a mission that are weakened by multiples of a step size."""

from __future__ import annotations

import math
from collections.abc import Callable

from missionc.base.late_dataclass import Record
from missionc.compiler.relax.edits import Edit, Spot

DOUBLINGS = 2
"""Maximum number of doublings of a number that has no other bound."""


class RelaxationParameter(Record):
    """A number of a mission that can be weakened, with edits of increasing size.

    Args:
        edit: edit that changes the number by some step sizes, from 1 to ``most``; None if the text cannot express it.
        size: step size, relative to the changed value.
        first: number of step sizes tried first.
        most: largest number of step sizes.
    """

    edit: Callable[[int], Edit | None]
    size: float
    first: int = 1
    most: int = 1


def notch(value: float) -> float:
    """Step size for changes of a number: a power of ten, between a tenth and a hundredth of the number."""
    return float(10 ** (math.floor(math.log10(abs(value))) - 1)) if value else 0.1


def more(spot: Spot, name: str, most: float = math.inf) -> RelaxationParameter:
    """Relaxation parameter that increases a number, up to four times its size or ``most``, in its own unit.

    Args:
        name: name of the number, as in "the radius of `radio`".
    """
    by = notch(spot.value)
    room = min(most - spot.value, max(abs(spot.value), 1.0) * (2**DOUBLINGS - 1))
    return _moved(spot, name, by, max(0, math.floor(room / by + 1e-9)))


def less(spot: Spot, name: str, least: float = 0.0) -> RelaxationParameter:
    """Relaxation parameter that decreases a number, down to ``least``, in its own unit."""
    by = notch(spot.value)
    return _moved(spot, name, -by, max(0, math.floor((spot.value - least) / by + 1e-9)))


def whole(spot: Spot, name: str, most: int, by: int = 1) -> RelaxationParameter:
    """Relaxation parameter that increases an integer by up to ``most``, or decreases it if ``by`` is -1."""
    return RelaxationParameter(_put(spot, name, by), 1 / max(1.0, abs(spot.value)), 1, most)


def _moved(spot: Spot, name: str, by: float, most: int) -> RelaxationParameter:
    size = abs(by) / (abs(spot.value) or 1.0)
    return RelaxationParameter(_put(spot, name, by), size, min(most, max(1, round(1 / size))), most)


def _put(spot: Spot, name: str, by: float) -> Callable[[int], Edit]:
    def edit(notches: int) -> Edit:
        value = spot.value + notches * by
        return spot.put(value, f"{name} {spot.written(value)} instead of {spot.written(spot.value)}")

    return edit
