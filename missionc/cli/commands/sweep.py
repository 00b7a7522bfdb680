"""``missionc sweep FILE``: compilation of a mission for many values and seeds, with one table and one page."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from missionc.backends.options import Options
from missionc.base.signals import release_stop
from missionc.base.units import Seconds
from missionc.cli import cluster_options, options, sweep_summary
from missionc.cli.commands.compile import PLANNING
from missionc.cli.disturbance_options import disturbance_of, of_disturbance
from missionc.cli.exit_status import Status, say
from missionc.cli.option_groups import GroupedCommand
from missionc.cli.progress import ProgressLine
from missionc.flight.simulation.trial_bounds import MOST_FLIGHTS

if TYPE_CHECKING:
    from missionc.tools.sweep.carry_out_sweep import RemainingTime, SweepRequest
    from missionc.tools.sweep.run_grid import Run
    from missionc.tools.sweep.sweep_folder import Row

MOST_SEEDS = 100_000


@click.command("sweep", cls=GroupedCommand)
@click.argument("file", type=options.existing, shell_complete=options.files)
@options.of_mission
@click.option(
    "--vary",
    "varied",
    type=options.pair,
    multiple=True,
    metavar="NAME=VALUES",
    help="Vary a mission parameter or a backend setting, such as N=3,5,8 or smt.nodes=100..400/100.",
)
@click.option(
    "--seeds",
    type=options.Count(1, MOST_SEEDS),
    default=1,
    show_default=True,
    metavar="K",
    help="Number of random seeds for each combination of values.",
)
@options.output("Sweep folder to write or to continue. [default: build/MISSION-sweep]")
@click.option("--keep", is_flag=True, help="Keep the plan folder of each run.")
@cluster_options.jobs
@cluster_options.cluster
@click.option(
    "--compare",
    type=options.folder,
    shell_complete=options.folders,
    metavar="FOLDER",
    help="Compare the results with the folder of a previous sweep.",
)
@options.vehicle
@options.backend
@options.of_a_plan(*PLANNING)
@options.set_values
@options.time_limit("Time limit of each run.")
@options.memory_limit
@options.between_steps
@click.option(
    "--simulate",
    "trials",
    type=options.Count(0, MOST_FLIGHTS),
    default=0,
    metavar="N",
    help="Simulate each plan N times with the given disturbances.",
)
@of_disturbance
@options.plot("Plot the results")
@options.plot_width
@options.quiet
def command(
    file: Path,
    overrides: options.Pairs,
    limits: options.Pairs,
    form: str,
    varied: options.Pairs,
    seeds: int,
    output: Path | None,
    keep: bool,
    jobs: int | None,
    cluster: str | None,
    compare: Path | None,
    vehicle: str | None,
    backend: str,
    settings: options.Pairs,
    time_limit: float,
    memory_limit: int,
    continuous: bool,
    at_steps: bool,
    trials: int,
    plot: Path | None,
    plot_width: str | None,
    quiet: bool,
    **more: Any,
) -> Status:
    """Compile a mission for each combination of values and seeds.

    The command checks all combinations first, and runs each in its own process. After an interruption, the same
    command continues with the remaining runs.
    """
    throughout = options.continuous_time(continuous, at_steps)
    if plot_width and plot is None:
        raise click.UsageError("`--plot-width` needs a plot; add `--plot FILE.svg`")
    cluster_options.understood(jobs, cluster)
    allowed = options.read_limits(limits)
    chosen = Options(**{name: more.pop(name) for name in PLANNING})
    amounts, lost = disturbance_of(**more)
    if not trials and (any(amounts.values()) or lost):
        raise click.UsageError("disturbances need simulated flights; add `--simulate N`")
    from missionc.tools.sweep.carry_out_sweep import SweepRequest, carry_out_sweep
    from missionc.tools.sweep.run_grid import Grid, read_varied
    from missionc.tools.sweep.run_request import Flights, Settings

    fixed = (*overrides, *settings)
    values = read_varied(varied, [name for name, _ in fixed])
    if isinstance(values, list):
        say(values, [], form, {})
        return Status.MISSION_ERRORS
    shared = Settings(
        {},
        dict(fixed),
        allowed,
        backend,
        vehicle or "",
        chosen,
        Seconds(time_limit),
        memory_limit,
        throughout,
        Flights(trials, amounts, lost) if trials else None,
        keep,
    )
    target = output or Path("build") / f"{file.stem}-sweep"
    request = SweepRequest(
        file,
        Grid(values, seeds),
        shared,
        target,
        lambda: cluster_options.opened_cluster(jobs, cluster),
        compare,
        (plot, plot_width or "") if plot else None,
    )
    with _progress(quiet or form == "json") as told:
        result = carry_out_sweep(told.listening(request))
    lines = [] if quiet else sweep_summary.swept_lines(result, target)
    say(result.findings, lines, form, sweep_summary.swept_document(result, target))
    release_stop()
    return Status.DONE if result.sound else Status.MISSION_ERRORS


class _Told:
    """Progress line of a sweep, shown only on a terminal."""

    def __init__(self, line: ProgressLine | None) -> None:
        self._line = line
        self._left = self._total = 0
        self._known: RemainingTime | None = None

    def listening(self, request: SweepRequest) -> SweepRequest:
        """Request whose listeners update the progress line; unchanged if there is no terminal."""
        if self._line is None:
            return request
        self._total = len(request.grid.combinations)
        return replace(request, checked=self._checked, began=self._began, ended=self._ended)

    def _say(self, words: str) -> None:
        if self._line is not None:
            self._line.say(words)

    def _checked(self, done: int) -> None:
        self._say(f"checking combinations: {done} of {self._total} done")

    def _began(self, left: list[Run], rows: Mapping[Run, Row]) -> None:
        from missionc.tools.sweep.carry_out_sweep import RemainingTime

        self._left, self._total = len(left), len(left) + len(rows)
        self._known = RemainingTime(Counter(run.values for run in left), rows)
        self._say(f"compiling: {len(rows)} of {self._total} runs done")

    def _ended(self, row: Row, workers: int) -> None:
        assert self._known is not None
        self._known.over(row)
        self._left -= 1
        left = self._known.left(workers)
        words = f", {_span(*left)} left" if left and self._left else ""
        done = f"{self._total - self._left} of {self._total} runs done"
        self._say(f"compiling: {done}, {workers} in parallel{words}")


@contextmanager
def _progress(silent: bool) -> Iterator[_Told]:
    if silent or not sys.stderr.isatty():
        yield _Told(None)
        return
    with ProgressLine(sys.stderr) as line:
        line.say("reading files")
        yield _Told(line)


def _span(low: float, high: float) -> str:
    """Range of durations in words: ``4 to 9 min``.

    Args:
        low, high: ends of the range, s.
    """
    unit, name = next(((size, name) for size, name in ((3600.0, "h"), (60.0, "min")) if high >= 2 * size), (1.0, "s"))
    least, most = f"{low / unit:.0f}", f"{high / unit:.0f}"
    return f"about {most} {name}" if least == most else f"{least} to {most} {name}"
