"""The two logics in which formulas are evaluated: truth and robustness; ``numpy.minimum`` is *and* in both."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.ir import Predicate
from missionc.ir.language.margins.predicate_margins import holds
from missionc.ir.language.margins.resources import BORDER

Values: TypeAlias = NDArray[Any]
"""Array of truth values or of robustness, depending on the logic."""


class Logic(Record):
    """Definition of a logic: its minimum and maximum value, its negation, and its value of a predicate's or link's
    margin.
    """

    bottom: Any
    top: Any
    negate: np.ufunc
    of_predicate: Callable[[Predicate, Values], Values]
    of_link: Callable[[Values], Values]
    of_length: Callable[[Values], Values]
    """Function from the margin of a route's length (with a closed bound) to a value of the logic."""


TRUTH = Logic(
    bottom=np.False_,
    top=np.True_,
    negate=np.logical_not,
    of_predicate=holds,
    of_link=lambda margin: margin > 0,
    of_length=lambda margin: margin >= 0,
)

ROBUSTNESS = Logic(
    bottom=np.float64(-np.inf),
    top=np.float64(np.inf),
    negate=np.negative,
    of_predicate=lambda _, margin: margin,
    of_link=lambda margin: margin,
    of_length=lambda margin: margin,
)


def decided_at_border(margins: Values, is_open: bool) -> Values:
    """Margins with 0 replaced by a tiny value: positive, or negative if the boundary does not belong to the region.

    Args:
        is_open: True if the boundary does not belong to it.
    """
    return np.where(margins == 0, -BORDER if is_open else BORDER, margins)
