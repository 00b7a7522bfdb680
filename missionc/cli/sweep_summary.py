"""Summary of a sweep: a line for each combination and comparison, and a JSON document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from missionc.base.trace import counted

if TYPE_CHECKING:
    from missionc.tools.sweep.carry_out_sweep import SweepResult
    from missionc.tools.sweep.results_table import Comparison, Group

MOST_LINES = 40
"""Maximum number of combinations and of comparisons that are listed; the page has all of them."""


def swept_lines(result: SweepResult, output: Path) -> list[str]:
    """Lines with the number of runs by outcome, and the success rate, planning time and length of each combination.

    Args:
        result: result of the sweep.
        output: folder of the results.
    """
    from missionc.tools.sweep.carry_out_sweep import PAGE
    from missionc.tools.sweep.results_table import CSV, PARQUET, counts, missing_writer

    if not result.groups:
        return []
    told = ", ".join(f"{count} {outcome}" for outcome, count in counts(result.rows.values()).items() if count)
    head = f"{result.mission}: {len(result.rows)} of {counted(result.total, 'run')} finished ({result.done} new)"
    lines = [f"{head}: {told}" if told else head, *_group_lines(result.groups), *_comparison_lines(result.comparisons)]
    if not result.complete:
        lines.append("run the same command again to continue")
    absent = missing_writer()
    note = [f"note: {absent.message}"] if absent else []
    tables = CSV if absent else f"{CSV} and {PARQUET}"
    return [*lines, *note, f"tables: {tables} in {output}", f"report: {output / PAGE}"]


def _group_lines(groups: Sequence[Group]) -> list[str]:
    from missionc.tools.sweep.results_table import measures
    from missionc.tools.sweep.run_answer import OUTCOMES
    from missionc.tools.sweep.run_grid import words
    from missionc.tools.sweep.sweep_html import figures, percent

    shown = measures(row for group in groups for row in group.rows)
    others = [outcome for outcome in OUTCOMES[1:] if any(group.outcomes[outcome] for group in groups)]
    rows = [["", "with a plan", *others, *(each.says + (f", {each.unit}" if each.unit else "") for each in shown)]]
    for group in groups[:MOST_LINES]:
        spreads = [figures(group.spreads.get(each.name)) for each in shown]
        without = [str(group.outcomes[outcome] or "") for outcome in others]
        rows.append([words(group.values), percent(group.success), *without, *spreads])
    lines = _columns(rows)
    more = len(groups) - MOST_LINES
    return [*lines, *([f"  and {counted(more, 'combination')} more in the report"] if more > 0 else [])]


def _comparison_lines(comparisons: Sequence[Comparison]) -> list[str]:
    from missionc.tools.sweep.run_grid import words

    if not comparisons:
        return []
    rows = [["", "", "before", "now", "", "p", "pairs", "test"]]
    for each in comparisons[:MOST_LINES]:
        name = "all runs" if each.values is None else words(each.values)
        unit = f", {each.measure.unit}" if each.measure.unit else ""
        numbers = [f"{each.old:.3g}", f"{each.new:.3g}", each.verdict, f"{each.p:.2g}", str(each.pairs)]
        rows.append([name, f"{each.measure.says}{unit}", *numbers, each.test])
    more = len(comparisons) - MOST_LINES
    rest = [f"  and {counted(more, 'comparison')} more in the report"] if more > 0 else []
    return ["comparison by pairs of equal values and seeds; p-values with Holm's correction", *_columns(rows), *rest]


def _columns(rows: Sequence[Sequence[str]]) -> list[str]:
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = ("  ".join(f"{cell:<{width}}" for cell, width in zip(row, wide, strict=True)) for row in rows)
    return [f"  {line}".rstrip() for line in padded]


def swept_document(result: SweepResult, output: Path) -> dict[str, object]:
    """JSON document of a sweep; ``output`` is null if nothing was written."""
    from missionc.tools.sweep.results_table import counts

    return {
        "mission": result.mission or None,
        "runs": result.total,
        "over": len(result.rows),
        "now": result.done,
        "complete": result.complete,
        "interrupted": result.interrupted,
        "outcomes": counts(result.rows.values()),
        "combinations": [_group(group) for group in result.groups],
        "comparisons": [each.as_record() for each in result.comparisons],
        "output": str(output) if result.groups else None,
    }


def _group(group: Group) -> Mapping[str, object]:
    return {
        "values": dict(group.values),
        "runs": len(group.rows),
        "outcomes": dict(group.outcomes),
        "success": asdict(group.success) if group.success else None,
        "spreads": {name: asdict(spread) for name, spread in group.spreads.items()},
    }
