"""Statistics of a sweep's runs, those of each combination together: success rates with intervals, medians, spreads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from missionc.simulate.confidence_interval import Fraction, fraction
from missionc.sweep.run_grid import Combination, Run
from missionc.sweep.run_result import ERROR, OUTCOMES
from missionc.sweep.sweep_folder import Row


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of a run: its name, what it is called and measured in, and whether more of it is better."""

    name: str
    says: str
    unit: str
    more_is_better: bool

    def of(self, row: Row) -> float | None:
        """The figure of a planned run; None where it has none."""
        if row.result.outcome != "planned":
            return None
        values = row.result.values
        if self.name == SHARE:
            flights, held = values.get("flights"), values.get("flights_kept")
            return int(held) / int(flights) if flights and held is not None else None
        value = values.get(self.name)
        return float(value) if isinstance(value, int | float) else None


SHARE = "share_kept"
SECONDS = Measure("seconds", "time to plan", "s", False)
MEASURES = (
    SECONDS,
    Measure("length", "path length", "m", False),
    Measure("robustness", "worst robustness", "m", True),
    Measure(SHARE, "flights as required", "", True),
    Measure("tracking_error", "tracking error", "m", False),
)
"""In the order in which they are shown; those that no run has are left out."""


@dataclass(frozen=True, slots=True)
class Spread:
    """The median of some figures, and the quartiles around it."""

    count: int
    low: float
    median: float
    high: float


@dataclass(frozen=True, slots=True)
class Group:
    """The runs of one combination.

    Args:
        outcomes: how many runs had each outcome.
        success: the share of those that ended by themselves that has a plan; None where none did.
        spreads: of each measure's name, over the planned runs.
    """

    values: Combination
    rows: tuple[Row, ...]
    outcomes: Mapping[str, int]
    success: Fraction | None
    spreads: Mapping[str, Spread]


def groups(combinations: Sequence[Combination], rows: Mapping[Run, Row]) -> list[Group]:
    """One for each combination, in this order, those without a run among them."""
    of: dict[Combination, list[Row]] = {values: [] for values in combinations}
    for run, row in rows.items():
        if run.values in of:
            of[run.values].append(row)
    return [_group(values, sorted(found, key=lambda row: row.run.seed)) for values, found in of.items()]


def pooled(found: Sequence[Group], first: int) -> list[Group]:
    """Those that agree in so many parameters, the first ones, together."""
    of: dict[Combination, list[Row]] = {}
    for group in found:
        of.setdefault(group.values[:first], []).extend(group.rows)
    return [_group(values, rows) for values, rows in of.items()]


def measures(rows: Iterable[Row]) -> list[Measure]:
    """Those that any of these runs has."""
    found = list(rows)
    return [measure for measure in MEASURES if any(measure.of(row) is not None for row in found)]


def counts(rows: Iterable[Row]) -> dict[str, int]:
    """How many runs had each outcome; in the order of ``OUTCOMES``, all of them."""
    found = [row.result.outcome for row in rows]
    return {outcome: found.count(outcome) for outcome in OUTCOMES}


def _group(values: Combination, rows: list[Row]) -> Group:
    outcomes = counts(rows)
    ended = len(rows) - outcomes[ERROR]
    success = fraction(outcomes["planned"], ended) if ended else None
    spreads = {
        measure.name: _spread(figures)
        for measure in MEASURES
        if (figures := [figure for row in rows if (figure := measure.of(row)) is not None])
    }
    return Group(values, tuple(rows), outcomes, success, spreads)


def _spread(figures: Sequence[float]) -> Spread:
    low, median, high = (float(value) for value in np.percentile(figures, [25, 50, 75]))
    return Spread(len(figures), low, median, high)
