"""Comparison of two sweeps: improvements and regressions, with statistical tests.

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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missionc.base.diagnostics.code import NOT_COMPARABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.ownership import shown
from missionc.tools.sweep.results_table import Measure, measures
from missionc.tools.sweep.run_answer import ERROR
from missionc.tools.sweep.run_grid import Combination, Grid, Run
from missionc.tools.sweep.sweep_folder import Row, SweepFolder

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
