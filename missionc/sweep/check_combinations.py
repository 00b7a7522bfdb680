"""The check of every combination of a sweep, before any of them is planned.

in   a mission's file, the grid, how it is checked
out  what was checked of each combination, and all findings: of those that several have, one
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from missionc.base.limits import Limits
from missionc.diagnostics.model import Diagnostic
from missionc.pipeline.checked import Checked
from missionc.pipeline.front_end import check
from missionc.sweep.run_grid import Combination, Grid, words

SHOWN = 4
"""Combinations that a finding names."""


@dataclass(frozen=True, slots=True, eq=False)
class CheckedGrid:
    """What was checked of each combination, in the grid's order, and the findings of all."""

    each: Mapping[Combination, Checked]
    findings: tuple[Diagnostic, ...]


def check_combinations(
    file: Path,
    grid: Grid,
    fixed: Mapping[str, str],
    backend: str,
    vehicle: str,
    limits: Limits,
    listen: Callable[[int], None],
) -> CheckedGrid:
    """Check them all; ``listen`` hears how many are."""
    each: dict[Combination, Checked] = {}
    for values in grid.combinations:
        overrides = {**fixed, **dict(values)}
        each[values] = check(file, overrides=overrides, backend=backend, vehicle=vehicle, limits=limits)
        listen(len(each))
    return CheckedGrid(each, _told_once(each))


def _told_once(each: Mapping[Combination, Checked]) -> tuple[Diagnostic, ...]:
    """Each finding once, with the combinations that have it, where those are not all."""
    found: dict[object, tuple[Diagnostic, list[Combination]]] = {}
    for values, checked in each.items():
        for finding in checked.findings:
            span = finding.primary.span if finding.primary else None
            place = None if span is None else (span.source.name, span.start, span.end)
            found.setdefault((finding.code.name, finding.message, place), (finding, []))[1].append(values)
    return tuple(_with_combinations(finding, of, len(each)) for finding, of in found.values())


def _with_combinations(finding: Diagnostic, of: list[Combination], all_there_are: int) -> Diagnostic:
    if len(of) == all_there_are:
        return finding
    more = f", and {len(of) - SHOWN} more" if len(of) > SHOWN else ""
    return replace(finding, notes=(*finding.notes, f"with {'; '.join(map(words, of[:SHOWN]))}{more}"))
