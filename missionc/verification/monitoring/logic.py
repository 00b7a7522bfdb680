"""The two logics of evaluation: truth, and robustness. ``numpy.minimum`` is *and* in both."""

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
"""Truth values or robustness, whichever the logic at work has."""


class Logic(Record):
    """What differs: the values, *not*, and what a margin means."""

    bottom: Any
    top: Any
    negate: np.ufunc
    of_predicate: Callable[[Predicate, Values], Values]
    of_link: Callable[[Values], Values]
    of_length: Callable[[Values], Values]
    """The value of what a route's length has left to a bound that it may reach."""


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
    """Margins with those at 0 moved off it, to the side that is true there; of an ``is_open`` border, none is."""
    return np.where(margins == 0, -BORDER if is_open else BORDER, margins)
