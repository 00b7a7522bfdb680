"""``missionc simulate FOLDER``: simulated flights of a quadrotor along the polynomials of a plan folder."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.signals import Stopped
from missionc.cli import cluster_options, flight_summary, options
from missionc.cli.disturbance_options import disturbance_of, engine, of_disturbance
from missionc.cli.exit_status import Status, say
from missionc.cli.option_groups import GroupedCommand
from missionc.cli.options import file_to_write, folder, folders, limits_and_form, read_limits
from missionc.cli.progress import ProgressLine
from missionc.flight.simulation.trial_bounds import LARGEST_SEED, MOST_FLIGHTS, QUADROTOR

if TYPE_CHECKING:
    from missionc.base.limits import Limits
    from missionc.flight.simulation.trials import Trial
    from missionc.tools.replay.simulate_folder import Simulated
    from missionc.tools.sweep.run_sweep import Pool

DRAWN = 20
"""Number of flights whose paths are plotted."""


@click.command("simulate", cls=GroupedCommand)
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@limits_and_form
@engine
@click.option(
    "--trials",
    type=options.Count(1, MOST_FLIGHTS),
    default=1,
    show_default=True,
    metavar="N",
    help="Number of simulated flights.",
)
@of_disturbance
@options.seed(LARGEST_SEED)
@click.option(
    "--trace", type=file_to_write, metavar="FILE", help="Write the trajectory of the first flight to a CSV file."
)
@options.plot("Plot the flights")
@cluster_options.jobs
@cluster_options.cluster
@click.option(
    "--journal",
    type=file_to_write,
    metavar="FILE",
    help="Save finished flights to FILE. After an interruption, the same command continues from FILE.",
)
@options.quiet_progress
def command(
    path: Path,
    limits: tuple[tuple[str, str], ...],
    form: str,
    engine: str,
    trials: int,
    seed: int,
    trace: Path | None,
    plot: Path | None,
    jobs: int | None,
    cluster: str | None,
    journal: Path | None,
    quiet: bool,
    **disturbed: Any,
) -> Status:
    """Simulate flights of a plan and check them against the mission.

    The command adds the simulated flights to the report of the folder.
    """
    from missionc.flight.simulation.disturbance import UNDISTURBED, Disturbance
    from missionc.flight.simulation.trials import Trial
    from missionc.tools.replay.simulate_folder import simulate

    amounts, lost = disturbance_of(**disturbed)
    disturbance = Disturbance(**amounts, lose=lost)
    if engine != QUADROTOR and (trials > 1 or disturbance != UNDISTURBED):
        raise click.UsageError(f"the engine `{engine}` supports no trials and no disturbances; remove `--engine`")
    cluster_options.understood(jobs, cluster)
    allowed = read_limits(limits)
    refused = _refused(path, trace, plot, journal)
    if refused:
        say([refused], [], form, {"passed": None})
        return Status.MISSION_ERRORS
    trial = Trial(engine, trials, disturbance, seed, DRAWN if plot else 1)
    with _progress(quiet or form == "json", trials) as listen:
        if jobs is None and cluster is None and journal is None:
            simulated = simulate(path, trial, allowed, listen)
        else:
            own = 1 if cluster is None and jobs is None else jobs
            found = _spread(
                path, trial, allowed, listen, bool(plot), lambda: cluster_options.opened_cluster(own, cluster), journal
            )
            if isinstance(found, Diagnostic):
                say([found], [], form, {"passed": None})
                return Status.MISSION_ERRORS
            simulated = found
    findings = list(simulated.findings)
    document = flight_summary.simulated_document(simulated)
    if simulated.opened and simulated.trials:
        from missionc.output.documents.simulation_json import simulation_json
        from missionc.tools.replay.render_report import add_simulation

        flown = simulation_json(simulated.opened.mission, document, simulated.trials.flown)
        findings += add_simulation(path, flown, allowed)
    if (trace or plot) and simulated.opened and simulated.trials:
        from missionc.output.folder.write_folder import write_file
        from missionc.output.plot.plot_flights import draw, table

        if trace:
            findings += filter(None, [write_file(trace, table(simulated.opened.mission, simulated.trials.flown))])
        if plot:
            picture = draw(simulated.opened.mission, simulated.trials, plot.suffix[1:])
            findings += filter(None, [write_file(plot, picture)])
    say(findings, flight_summary.simulated_lines(simulated), form, document)
    if findings:
        return Status.MISSION_ERRORS
    return Status.DONE if simulated.passed else Status.VIOLATED


def _spread(
    path: Path,
    trial: Trial,
    limits: Limits,
    listen: Callable[[int], None],
    curves: bool,
    workers: Callable[[], AbstractContextManager[Pool | Diagnostic]],
    journal: Path | None,
) -> Simulated | Diagnostic:
    """Simulate flights on other processes or machines, or return the finding that this is not possible.

    Args:
        path: path of the plan folder.
        trial: conditions of the flights.
        limits: maximum sizes of the files.
        listen: called with the number of finished flights.
        curves: whether to include the error over time of each flight, for a picture.
        workers: function that returns a context manager with the pool.
        journal: path of the journal of finished flights, or None.
    """
    from missionc.tools.replay.simulate_folder import simulate
    from missionc.tools.sweep import flights_journal
    from missionc.tools.sweep.spread_trials import NotFlown, SpreadTrials

    with flights_journal.opened(journal) if journal else nullcontext() as kept, workers() as pool:
        for each in (kept, pool):
            if isinstance(each, Diagnostic):
                return each
        assert not isinstance(kept, Diagnostic)
        assert not isinstance(pool, Diagnostic)
        try:
            return simulate(path, trial, limits, listen, SpreadTrials(pool, limits, curves, kept))
        except NotFlown as error:
            return error.finding
        except Stopped:
            if kept and kept.over:
                click.echo(f"{len(kept.over)} flights saved; run the same command again to continue", err=True)
            raise


def _refused(path: Path, trace: Path | None, plot: Path | None, journal: Path | None) -> Diagnostic | None:
    """Finding about an output that cannot be written, before any flight; None if all can.

    Args:
        path: path of the plan folder.
        trace, plot, journal: paths of the outputs, or None.
    """
    if not (trace or plot or journal):
        return None
    from missionc.output.folder.overlap import WrittenPath, overlapping
    from missionc.output.folder.write_folder import refuse_file
    from missionc.output.plot.plot import missing

    named = ("--trace", trace), ("--plot", plot), ("--journal", journal)
    outputs = [WrittenPath(flag, file) for flag, file in named if file]
    return (
        overlapping(outputs, [path])
        or (plot and (missing() or refuse_file(plot)))
        or next(filter(None, (refuse_file(file) for file in (trace, journal) if file)), None)
        or None
    )


@contextmanager
def _progress(silent: bool, trials: int) -> Iterator[Callable[[int], None]]:
    """Yield a function that shows the number of finished flights on a terminal, and does nothing elsewhere."""
    if silent or not sys.stderr.isatty():
        yield lambda done: None
        return
    with ProgressLine(sys.stderr) as line:
        line.say("simulating flights")
        yield lambda done: line.say(f"simulating flights: {done} of {trials} done")
