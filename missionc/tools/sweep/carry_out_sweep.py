"""Complete sweep: checks, start or resumption, runs, tables, page, and estimated remaining time.

    in   SweepRequest
    out  SweepResult
    says MC404 MC701 MC702 MC730 MC760 MC761 MC762 MC763 MC764 MC765 MC766, and the codes of ``check``

Every combination is checked before any is planned. A finding that several combinations share appears once. The
remaining time is an interval estimated from the finished runs, or unknown if there are too few.
"""

from __future__ import annotations

import math
import shlex
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

from missionc.backends.options import DESCRIBED
from missionc.backends.setting import flag_of
from missionc.base.diagnostics.code import NOT_TO_BE_LOST
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.limits import Limits
from missionc.base.signals import defer_stop, stop_requested
from missionc.base.source import Source
from missionc.base.trace import counted
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked, check
from missionc.compiler.provenance import inputs
from missionc.extension import Mission
from missionc.output.folder.manifest import sha256
from missionc.output.folder.write_folder import write_file, write_inside
from missionc.output.plot import plot
from missionc.tools.sweep import results_table, run_answer
from missionc.tools.sweep.append_journal import Journal
from missionc.tools.sweep.plot_sweep import sweep_figure
from missionc.tools.sweep.results_table import Comparison, Group, compare_sweeps, groups, refuse
from missionc.tools.sweep.run_answer import ERROR
from missionc.tools.sweep.run_grid import Combination, Grid, Run, too_many, words
from missionc.tools.sweep.run_request import Settings
from missionc.tools.sweep.run_sweep import Pool, run_sweep
from missionc.tools.sweep.sweep_folder import PLANS, Row, SweepFolder, at_work, begin, over, read_sweep
from missionc.tools.sweep.sweep_html import Page, place_of, sweep_html

SHOWN = 4
"""Maximum number of combinations that a finding names."""


@dataclass(frozen=True, slots=True, eq=False)
class CheckedGrid:
    """Checks of all combinations in the grid's order, and their findings without duplicates."""

    each: Mapping[Combination, Checked]
    findings: tuple[Diagnostic, ...]


def check_combinations(
    file: Path | Source,
    grid: Grid,
    fixed: Mapping[str, str],
    backend: str,
    vehicle: str,
    limits: Limits,
    listen: Callable[[int], None],
) -> CheckedGrid:
    """Check all combinations.

    Args:
        file: path of the mission, or its text.
        grid: varied values.
        fixed: parameters with one value, as texts.
        backend: name of a backend, or ``auto``.
        vehicle: vehicle profile of teams that name none.
        limits: maximum sizes of a mission.
        listen: called with the number of finished checks.
    """
    each: dict[Combination, Checked] = {}
    for values in grid.combinations:
        overrides = {**fixed, **dict(values)}
        each[values] = check(file, overrides=overrides, backend=backend, vehicle=vehicle, limits=limits)
        listen(len(each))
    return CheckedGrid(each, _told_once(each))


def _told_once(each: Mapping[Combination, Checked]) -> tuple[Diagnostic, ...]:
    """Findings without duplicates, each with its combinations in words unless it applies to all."""
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


NORMAL_95 = 1.959963984540054
"""Quantile of the standard normal distribution that bounds its symmetric 95 % interval."""

LEAST = 5
"""Minimum number of finished runs for an estimate."""


class RemainingTime:
    """Estimate of the remaining time from the times of finished runs, including those of earlier commands.

    Runs of one combination take similar times. For combinations without finished runs, the estimate uses all runs,
    which widens the interval.

    Args:
        left: number of remaining runs of each combination.
        rows: finished runs.
    """

    def __init__(self, left: Mapping[Combination, int], rows: Mapping[Run, Row]) -> None:
        self._left = dict(left)
        self._took: dict[Combination, list[float]] = {}
        for run, row in rows.items():
            self._took.setdefault(run.values, []).append(_seconds(row))

    def over(self, row: Row) -> None:
        """Record a finished run."""
        self._left[row.run.values] = self._left.get(row.run.values, 1) - 1
        self._took.setdefault(row.run.values, []).append(_seconds(row))

    def left(self, workers: int) -> tuple[float, float] | None:
        """Interval of the remaining seconds with 95 % probability.

        None if too few runs are finished, or if there are no workers.
        """
        known = [seconds for own in self._took.values() for seconds in own]
        if len(known) < LEAST or not workers:
            return None
        mean, variance = 0.0, 0.0
        for values, count in self._left.items():
            own = self._took.get(values, ())
            sample = own if len(own) >= LEAST else known
            middle, spread = _moments(sample)
            mean += count * middle
            variance += spread * (count + count**2 / len(sample))
        width = NORMAL_95 * math.sqrt(variance)
        return max(0.0, mean - width) / workers, (mean + width) / workers


def _seconds(row: Row) -> float:
    values = row.result.values
    return sum(float(value) for name in ("seconds", "flown_in") if isinstance(value := values.get(name), int | float))


def _moments(sample: list[float] | tuple[float, ...]) -> tuple[float, float]:
    mean = sum(sample) / len(sample)
    return mean, sum((each - mean) ** 2 for each in sample) / max(1, len(sample) - 1)


def every(seconds: Seconds, work: Callable[[], object]) -> Callable[[], None]:
    """Function that calls ``work`` at most every ``seconds``, and for at most a tenth of the time."""
    due = time.monotonic() + seconds

    def perhaps() -> None:
        nonlocal due
        began = time.monotonic()
        if began >= due:
            work()
            now = time.monotonic()
            due = now + max(seconds, 10 * (now - began))

    return perhaps


PAGE = "sweep.html"
AGAIN = Seconds(60.0)
"""Seconds between updates of the tables and the page during the runs."""


def unheard(*told: object) -> None:
    """Listener that does nothing."""


@dataclass(frozen=True, slots=True)
class SweepRequest:
    """Request for a sweep.

    Args:
        file: path of the mission, or its text.
        grid: varied values.
        settings: settings of all runs; files and versions are filled in.
        folder: folder of the results.
        workers: function that returns a context manager with the pool of workers, or a finding.
        compare: folder of an older sweep.
        plot: file and width of a separate figure.
        checked: called with the number of checked combinations.
        began: called with the remaining and the finished runs.
        ended: called with each finished run and the number of workers.
    """

    file: Path | Source
    grid: Grid
    settings: Settings
    folder: Path
    workers: Callable[[], AbstractContextManager[Pool | Diagnostic]]
    compare: Path | None = None
    plot: tuple[Path, str] | None = None
    checked: Callable[[int], None] = unheard
    began: Callable[[list[Run], Mapping[Run, Row]], None] = unheard
    ended: Callable[[Row, int], None] = unheard


@dataclass(frozen=True, slots=True)
class SweepResult:
    """Result of a sweep.

    Args:
        findings: errors and warnings.
        mission: name of the mission; empty if it is unreadable.
        total: total number of runs.
        rows: finished runs.
        groups: finished runs by combination.
        comparisons: comparisons with an older sweep.
        done: number of runs done by this command.
        interrupted: whether the sweep was interrupted.
    """

    findings: tuple[Diagnostic, ...]
    mission: str = ""
    total: int = 0
    rows: Mapping[Run, Row] = field(default_factory=dict)
    groups: tuple[Group, ...] = ()
    comparisons: tuple[Comparison, ...] = ()
    done: int = 0
    interrupted: bool = False

    @property
    def complete(self) -> bool:
        return 0 < self.total == len(over(self.rows))

    @property
    def sound(self) -> bool:
        """Return whether no finding is an error, and no run was invalid, unverified or crashed."""
        bad = {row.result.outcome for row in self.rows.values()} & {"refused", "unverified", ERROR}
        return not bad and not has_errors(list(self.findings))


def carry_out_sweep(request: SweepRequest) -> SweepResult:
    """Check all combinations, do the remaining runs, and write the tables and the page."""
    large = too_many(len(request.grid))
    if large:
        return SweepResult((large,))
    settings, grid = request.settings, request.grid
    found = check_combinations(
        request.file, grid, settings.fixed, settings.backend, settings.vehicle, settings.limits, request.checked
    )
    if has_errors(list(found.findings)):
        return SweepResult(found.findings)
    first = next(iter(found.each.values()))
    old = read_sweep(request.compare) if request.compare else None
    wrong = _refused(request, found) or (old if isinstance(old, Diagnostic) else None)
    wrong = wrong or (refuse(old, grid) if isinstance(old, SweepFolder) else None)
    if wrong:
        return SweepResult((*found.findings, wrong))
    assert not isinstance(old, Diagnostic)
    settings = replace(settings, files=dict(inputs(first)), versions=run_answer.versions_here())
    about = {
        "mission": first.valid_mission.name,
        "file": next(iter(settings.files)),
        "inputs": {name: sha256(content) for name, content in settings.files.items()},
        "varied": {each.name: list(each.values) for each in grid.varied},
        "seeds": grid.seeds,
        **settings.shared,
    }
    wrong = begin(request.folder, about, settings.files)
    if wrong:
        return SweepResult((*found.findings, wrong))
    with at_work(request.folder) as journal:
        if isinstance(journal, Diagnostic):
            return SweepResult((*found.findings, journal))
        return _at_work(replace(request, settings=settings), found, first.valid_mission, old, journal)


def _refused(request: SweepRequest, found: CheckedGrid) -> Diagnostic | None:
    """First error of the request itself, apart from errors of the mission; None if there is none."""
    lost = request.settings.flights.lost if request.settings.flights else ()
    return (plot.missing() if request.plot else None) or next(
        filter(None, (_not_there(each.mission, lost) for each in found.each.values() if each.mission)), None
    )


def _not_there(mission: Mission, lost: tuple[tuple[str, float], ...]) -> Diagnostic | None:
    if not lost:
        return None
    from missionc.flight.simulation.disturbance import Disturbance
    from missionc.flight.simulation.trials import cannot_lose

    why = cannot_lose(mission, Disturbance(lose=lost))
    help_ = "write `--lose AGENT@T` with an agent of every combination"
    return Diagnostic(NOT_TO_BE_LOST, why, None, help=help_) if why else None


def _at_work(
    request: SweepRequest, found: CheckedGrid, mission: Mission, old: SweepFolder | None, journal: Journal
) -> SweepResult:
    """Do the remaining runs, with the folder locked.

    Args:
        request: request for the sweep.
        found: checks of all combinations.
        mission: mission of one combination.
        old: older sweep to compare with, or None.
        journal: locked journal of the folder.
    """
    read = read_sweep(request.folder)
    if isinstance(read, Diagnostic):
        return SweepResult((*found.findings, read))
    runs = list(request.grid.runs())
    wanted = frozenset(runs)
    rows = {run: row for run, row in over(read.rows).items() if run in wanted}
    left = [run for run in runs if run not in rows]
    before = len(rows)
    request.began(left, rows)
    defer_stop()
    finding, interrupted = None, False
    write = _Outputs(request, mission.name, found, old)
    if left:
        perhaps = every(AGAIN, lambda: write.all(rows))

        def heard(row: Row, workers: int) -> None:
            request.ended(row, workers)
            perhaps()

        with request.workers() as pool:
            if isinstance(pool, Diagnostic):
                return SweepResult((*found.findings, pool), mission.name, len(runs), rows)
            engines = {values: each.choice.engines if each.choice else () for values, each in found.each.items()}
            swept = run_sweep(
                iter(left), request.settings, engines, rows, pool, journal, request.folder, stop_requested, heard
            )
            finding, interrupted = swept.finding, swept.interrupted and swept.finding is None
    groups_, comparisons, findings = write.all(rows)
    return SweepResult(
        (*found.findings, *([finding] if finding else []), *findings),
        mission.name,
        len(runs),
        rows,
        tuple(groups_),
        tuple(comparisons),
        len(rows) - before,
        interrupted,
    )


@dataclass(frozen=True, slots=True)
class _Outputs:
    """Writer of the tables, the page, the separate figure and the comparison."""

    request: SweepRequest
    mission: str
    found: CheckedGrid
    old: SweepFolder | None

    def all(self, rows: Mapping[Run, Row]) -> tuple[list[Group], list[Comparison], list[Diagnostic]]:
        """Write all files, each atomically; return the groups, the comparisons and the errors."""
        grid, folder = self.request.grid, self.request.folder
        ordered = {run: rows[run] for run in grid.runs() if run in rows}
        compared = compare_sweeps(self.old, ordered) if self.old and ordered else []
        comparisons = [] if isinstance(compared, Diagnostic) else compared
        by_values = groups(grid.combinations, ordered)
        table = results_table.Table(grid.names, ordered.values())
        files = {results_table.CSV: table.csv()}
        if results_table.missing_writer() is None:
            files[results_table.PARQUET] = table.parquet()
        files[PAGE] = sweep_html(self._page(by_values, comparisons))
        wrong = [write_inside(folder, name, content) for name, content in files.items()]
        if self.request.plot:
            path, width = self.request.plot
            wrong.append(write_file(path, sweep_figure(grid.names, by_values, path.suffix[1:], width)))
        findings = [compared] if isinstance(compared, Diagnostic) else []
        return by_values, comparisons, [*findings, *filter(None, wrong)]

    def _page(self, by_values: list[Group], comparisons: list[Comparison]) -> Page:
        grid = self.request.grid
        varied = [f"{counted(len(each.values), 'value')} of {each.name}" for each in grid.varied]
        about = " × ".join([*varied, counted(grid.seeds, "seed")])
        drawn = plot.missing() is None and any(group.rows for group in by_values)

        def link(row: Row) -> str:
            return place_of(row, self._report(row))

        figure = sweep_figure(grid.names, by_values, "svg", "", link) if drawn else b""
        return Page(self.mission, about, grid.names, by_values, figure, comparisons, self._command, self._report)

    def _report(self, row: Row) -> str:
        from missionc.output.folder.file_names import REPORT

        there = (self.request.folder / PLANS / row.run.name / REPORT).is_file()
        return f"{PLANS}/{row.run.name}/{REPORT}" if there else ""

    def _command(self, row: Row) -> str:
        """Command line that repeats a run alone."""
        settings, file = self.request.settings, self.request.file
        words = ["missionc", "compile", file.name if isinstance(file, Source) else str(file)]
        for name, value in {**settings.fixed, **dict(row.run.values)}.items():
            words += [flag_of(name), f"{name}={value}"]
        words += ["--seed", str(row.run.seed), "--time-limit", f"{settings.time_limit:g}"]
        words += ["--backend", settings.backend] if settings.backend != "auto" else []
        words += ["--vehicle", settings.vehicle] if settings.vehicle else []
        for each in DESCRIBED.values():
            if getattr(settings.options, each.name) != each.default:
                words += each.words(settings.options)
        return shlex.join(words)
