"""Table of a sweep: a row for each run in the grid's order, as CSV and Parquet, and group statistics.

The columns in ``OF_THE_MACHINE`` depend on the machine. All others are independent of machine and parallelism, unless
the run was cut short. Statistics of each combination are success rates with intervals, medians and spreads.

Comparison of two sweeps: improvements and regressions, with statistical tests.

    in   the rows of an old and of a new sweep
    out  a Comparison for each quantity, for all runs and for each combination
    says MC766

Runs are paired by their values and their seed. Success is compared with McNemar's exact test, every other quantity with
Wilcoxon's signed-rank test over the pairs in which both have a plan. The p-values are adjusted with Holm's method,
separately for all runs and for the combinations.

Source:
    McNemar, "Note on the sampling error of the difference between correlated proportions" (1947).
    Wilcoxon, "Individual comparisons by ranking methods" (1945).
    Holm, "A simple sequentially rejective multiple test procedure" (1979).
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np

from missionc.base.diagnostics.code import EXTRA_MISSING, NOT_COMPARABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.flight.simulation.trials import Fraction, fraction
from missionc.output.folder.ownership import shown
from missionc.tools.sweep.run_answer import ERROR, OUTCOMES, Value
from missionc.tools.sweep.run_grid import Combination, Grid, Run, number_of
from missionc.tools.sweep.sweep_folder import Row, SweepFolder


@dataclass(frozen=True, slots=True)
class Measure:
    """Quantity of a run: its name, title and unit, and whether higher is better."""

    name: str
    says: str
    unit: str
    more_is_better: bool

    @property
    def label(self) -> str:
        """Title and unit, as on axes and in headings."""
        return f"{self.says} ({self.unit})" if self.unit else self.says

    def of(self, row: Row) -> float | None:
        """Value of the quantity for a run; None if it has none or the run is not planned."""
        if row.result.outcome != "planned":
            return None
        values = row.result.values
        if self.name == SHARE:
            flights, held = values.get("flights"), values.get("flights_kept")
            return int(held) / int(flights) if flights and held is not None else None
        value = values.get(self.name)
        return float(value) if isinstance(value, int | float) else None


SHARE = "share_kept"
SECONDS = Measure("seconds", "planning time", "s", False)
MEASURES = (
    SECONDS,
    Measure("length", "path length", "m", False),
    Measure("robustness", "smallest robustness", "m", True),
    Measure(SHARE, "successful flights", "", True),
    Measure("tracking_error", "tracking error", "m", False),
)
"""Quantities in display order; those without values are omitted."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Number, lower quartile, median and upper quartile of some values."""

    count: int
    low: float
    median: float
    high: float


@dataclass(frozen=True, slots=True)
class Group:
    """Runs of one combination.

    Args:
        values: combination.
        rows: its finished runs.
        outcomes: number of runs with each outcome.
        success: success rate among runs that ended normally, or None.
        spreads: spread of each quantity by name, over the planned runs.
    """

    values: Combination
    rows: tuple[Row, ...]
    outcomes: Mapping[str, int]
    success: Fraction | None
    spreads: Mapping[str, Spread]


def groups(combinations: Sequence[Combination], rows: Mapping[Run, Row]) -> list[Group]:
    """One group for each combination, in order; a group without runs is empty."""
    of: dict[Combination, list[Row]] = {values: [] for values in combinations}
    for run, row in rows.items():
        if run.values in of:
            of[run.values].append(row)
    return [_group(values, sorted(found, key=lambda row: row.run.seed)) for values, found in of.items()]


def pooled(found: Sequence[Group], first: int) -> list[Group]:
    """Groups merged by equal values of the ``first`` leading parameters."""
    of: dict[Combination, list[Row]] = {}
    for group in found:
        of.setdefault(group.values[:first], []).extend(group.rows)
    return [_group(values, rows) for values, rows in of.items()]


def measures(rows: Iterable[Row]) -> list[Measure]:
    """Quantities that at least one of the runs has."""
    found = list(rows)
    return [measure for measure in MEASURES if any(measure.of(row) is not None for row in found)]


def counts(rows: Iterable[Row]) -> dict[str, int]:
    """Number of runs by outcome, for all of ``OUTCOMES`` in order."""
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


CSV, PARQUET = "runs.csv", "runs.parquet"

COLUMNS: dict[str, type] = {
    "seed": int,
    "outcome": str,
    "scope": str,
    "engine": str,
    "cut_short": str,
    "agents": int,
    "steps": int,
    "seconds": float,
    "flown_in": float,
    "cpu_seconds": float,
    "peak_bytes": int,
    "length": float,
    "duration": float,
    "robustness": float,
    "tightest": str,
    "margin": float,
    "flights": int,
    "flights_kept": int,
    "tracking_error": float,
    "plan": str,
    "codes": str,
    "says": str,
    "host": str,
}
"""Type of the columns of every table by name, between the parameters and the sizes."""
OF_THE_MACHINE = ("seconds", "flown_in", "cpu_seconds", "peak_bytes", "host", "size_solver_bytes")


class Table:
    """Rows of values, and the type of each column by name."""

    def __init__(self, names: Sequence[str], rows: Iterable[Row]) -> None:
        found = list(rows)
        units = {name: _unit([dict(row.run.values)[name] for row in found]) for name in names}
        sizes = sorted({size for row in found for size in row.result.sizes})
        self.parameters = {name: _column(name, unit) for name, unit in units.items()}
        self.types: dict[str, type] = {
            "run": str,
            **{self.parameters[name]: str if units[name] is None else float for name in names},
            **COLUMNS,
            **{_size_column(size): int for size in sizes},
        }
        self.rows = [self._cells(row, names) for row in found]

    def _cells(self, row: Row, names: Sequence[str]) -> dict[str, Value]:
        values = dict(row.run.values)
        cells: dict[str, Value] = {
            "run": row.run.name,
            **{self.parameters[name]: _number(values[name], self.types[self.parameters[name]]) for name in names},
            "seed": row.run.seed,
            "outcome": row.result.outcome,
            "host": row.host or None,
            **row.result.values,
            **{_size_column(size): count for size, count in row.result.sizes.items()},
        }
        return {name: _of_type(cells.get(name), kind) for name, kind in self.types.items()}

    def csv(self) -> bytes:
        """CSV in UTF-8 with a header; missing values are empty."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.types)
        writer.writerows(["" if cell is None else cell for cell in row.values()] for row in self.rows)
        return text.getvalue().encode("utf-8", "replace")

    def parquet(self) -> bytes:
        """Parquet with a type for each column; needs pyarrow."""
        import pyarrow
        from pyarrow import parquet

        kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
        schema = pyarrow.schema([(name, kinds[kind]) for name, kind in self.types.items()])
        sink = io.BytesIO()
        parquet.write_table(pyarrow.Table.from_pylist(self.rows, schema=schema), sink)
        return sink.getvalue()


def missing_writer() -> Diagnostic | None:
    """Finding that pyarrow, which writes Parquet, is not installed; None if it is."""
    if find_spec("pyarrow"):
        return None
    message = "a table in Parquet needs the package pyarrow, which is not installed"
    return Diagnostic(EXTRA_MISSING, message, None, help="install it with `pip install 'missionc[sweep]'`")


def _size_column(size: str) -> str:
    return f"size_{size.replace(' ', '_')}"


def _column(name: str, unit: str | None) -> str:
    """Name of a parameter's column, with the unit of numeric values."""
    return f"{name} [{unit}]" if unit else f"param_{name}" if name in COLUMNS or name == "run" else name


def _unit(values: list[str]) -> str | None:
    """Common unit of numeric values, empty without one; None if they are not numbers with the same unit."""
    units = {None if number is None else number[1] for number in map(number_of, values)}
    return units.pop() if len(units) == 1 else None


def _number(text: str, kind: type) -> Value:
    number = number_of(text)
    return text if kind is str or number is None else number[0]


def _of_type(value: Value, kind: type) -> Value:
    """Value converted to a column's type, or None if that is not possible."""
    if value is None or kind is str:
        return None if value is None else str(value)
    try:
        return int(value) if kind is int else float(value)
    except ValueError:
        return None


LEVEL = 0.05
"""Significance level for p-values."""
MCNEMAR, WILCOXON = "McNemar's exact test", "Wilcoxon's signed-rank test"
SUCCESS = Measure("planned", "runs with a plan", "", True)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of one quantity over the runs of one combination, or of all.

    Args:
        measure: compared quantity.
        values: combination; None for all runs.
        pairs: number of compared pairs of runs.
        old, new: success rate, or median, in the old and the new sweep.
        test: name of the test.
        p: adjusted p-value.
        direction: positive if the new runs mostly have higher values.
        tellable: whether that number of pairs can be significant.
    """

    measure: Measure
    values: Combination | None
    pairs: int
    old: float
    new: float
    test: str
    p: float
    direction: float
    tellable: bool = True

    @property
    def verdict(self) -> str:
        """Verdict in words: ``better``, ``worse``, ``the same``, ``noise``, or too few pairs."""
        if self.p < LEVEL:
            return "better" if (self.direction > 0) == self.measure.more_is_better else "worse"
        if self.p == 1 and self.direction == 0:
            return "the same"
        return "noise" if self.tellable else "too few pairs for a verdict"

    def as_record(self) -> dict[str, object]:
        return {
            "figure": self.measure.name,
            "values": None if self.values is None else dict(self.values),
            "pairs": self.pairs,
            "old": self.old,
            "new": self.new,
            "test": self.test,
            "p": self.p,
            "verdict": self.verdict,
        }


def compare_sweeps(old: SweepFolder, rows: Mapping[Run, Row]) -> list[Comparison] | Diagnostic:
    """All comparisons, those of all runs first, or the finding that the sweeps have no run in common.

    Args:
        old: sweep read from its folder.
        rows: rows of the new sweep.
    """
    both = [(old.rows[run], row) for run, row in rows.items() if run in old.rows]
    both = [pair for pair in both if ERROR not in (pair[0].result.outcome, pair[1].result.outcome)]
    if not both:
        return _nothing(old)
    by_values: dict[Combination, list[tuple[Row, Row]]] = {}
    for pair in both:
        by_values.setdefault(pair[1].run.values, []).append(pair)
    whole = _adjusted(_compared(None, both))
    each = [found for values, pairs in by_values.items() for found in _compared(values, pairs)]
    return [*whole, *(_adjusted(each) if len(by_values) > 1 else [])]


def refuse(old: SweepFolder, grid: Grid) -> Diagnostic | None:
    """Finding that the sweeps have no run in common, before any run; None if they have one."""
    return None if any(run in old.rows for run in grid.runs()) else _nothing(old)


def _nothing(old: SweepFolder) -> Diagnostic:
    help_ = "compare sweeps with common parameters, values and seeds"
    return Diagnostic(NOT_COMPARABLE, f"this sweep and `{shown(old.path)}` have no run in common", None, help=help_)


def _compared(values: Combination | None, pairs: Sequence[tuple[Row, Row]]) -> list[Comparison]:
    found = [_success(values, pairs)]
    for measure in measures(row for pair in pairs for row in pair):
        figures = [(measure.of(old), measure.of(new)) for old, new in pairs]
        known = [(old, new) for old, new in figures if old is not None and new is not None]
        if known:
            found.append(_ranks(measure, values, known))
    return found


def _success(values: Combination | None, pairs: Sequence[tuple[Row, Row]]) -> Comparison:
    """Comparison of the success rates of paired runs with McNemar's exact test."""
    from scipy.stats import binomtest

    planned = [(old.result.outcome == "planned", new.result.outcome == "planned") for old, new in pairs]
    lost = sum(old and not new for old, new in planned)
    won = sum(new and not old for old, new in planned)
    p = float(binomtest(won, won + lost).pvalue) if won + lost else 1.0
    shares = [sum(column) / len(planned) for column in zip(*planned, strict=True)]
    least = 2 * 0.5 ** (won + lost)
    return Comparison(SUCCESS, values, len(pairs), shares[0], shares[1], MCNEMAR, p, won - lost, least < LEVEL)


def _ranks(measure: Measure, values: Combination | None, pairs: Sequence[tuple[float, float]]) -> Comparison:
    """Comparison of a quantity in paired runs with Wilcoxon's signed-rank test; zero differences are dropped."""
    from scipy.stats import rankdata, wilcoxon

    old, new = np.array(pairs).T
    changes = np.round(new - old, 9)
    changes = changes[changes != 0]
    p = float(wilcoxon(changes).pvalue) if changes.size else 1.0
    direction = float(np.sum(np.sign(changes) * rankdata(np.abs(changes)))) if changes.size else 0.0
    medians = float(np.median(old)), float(np.median(new))
    return Comparison(measure, values, len(pairs), *medians, WILCOXON, p, direction, 2 * 0.5**changes.size < LEVEL)


def _adjusted(found: list[Comparison]) -> list[Comparison]:
    """Comparisons with p-values adjusted for multiple tests by Holm's method."""
    order = sorted(range(len(found)), key=lambda number: found[number].p)
    least, adjusted = 0.0, list(found)
    for rank, number in enumerate(order):
        least = max(least, min(1.0, found[number].p * (len(found) - rank)))
        adjusted[number] = replace(found[number], p=least)
    return adjusted
