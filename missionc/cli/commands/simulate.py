"""``missionc simulate FOLDER``: the written polynomials flown by a simulated quadrotor."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from missionc.cli import flight_summary
from missionc.cli.exit_status import Status, say
from missionc.cli.options import Number, file_to_write, folder, folders, limits_and_form, picture, read_limits
from missionc.cli.progress import ProgressLine
from missionc.diagnostics.model import Diagnostic
from missionc.simulate.trial_bounds import (
    ENGINES,
    LARGEST_SEED,
    MOST_CLOCK_ERROR,
    MOST_DOWNWASH,
    MOST_FLIGHTS,
    MOST_LATENCY,
    MOST_LOSS,
    MOST_LOST,
    MOST_MASS_ERROR,
    MOST_NOISE,
    MOST_START_ERROR,
    MOST_WIND,
)

DRAWN = 20
"""Flights whose paths are drawn."""


def wind(value: str) -> tuple[float, float]:
    """``MEAN`` or ``MEAN,GUST``, m/s."""
    words = value.split(",")
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2 or not all(0 <= number <= MOST_WIND for number in numbers):
        raise click.UsageError(f"`{value}` is not a wind such as 1 or 1,0.5, in m/s")
    return numbers[0], numbers[1] if len(numbers) > 1 else 0.0


def loss(value: str) -> tuple[str, float]:
    """``AGENT@T``, with T in seconds."""
    name, _, when = value.rpartition("@")
    try:
        moment = float(when)
    except ValueError:
        moment = math.nan
    if not name or not 0 <= moment < math.inf:
        raise click.UsageError(f"`{value}` is no agent and a second such as drone[0]@5")
    return name, moment + 0.0


def _once(lose: tuple[tuple[str, float], ...]) -> tuple[tuple[str, float], ...]:
    names = [name for name, _ in lose]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise click.UsageError(f"`{twice}` can be lost once")
    if len(lose) > MOST_LOST:
        raise click.UsageError(f"at most {MOST_LOST} agents can be lost")
    return lose


@click.command("simulate")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@limits_and_form
@click.option("--engine", type=click.Choice(ENGINES), default=ENGINES[0], show_default=True)
@click.option("--trials", type=click.IntRange(1, MOST_FLIGHTS), default=1, show_default=True, metavar="N")
@click.option("--wind", "air", type=wind, default="0", metavar="MEAN[,GUST]", help="In m/s; level, from anywhere.")
@click.option(
    "--mass-error",
    type=Number(0, MOST_MASS_ERROR),
    default=0.0,
    metavar="PERCENT",
    help="Each vehicle weighs up to so much more or less than its controller thinks.",
)
@click.option(
    "--start-error",
    type=Number(0, MOST_START_ERROR),
    default=0.0,
    metavar="METRES",
    help="Each begins up to so far beside its start, along x and along y.",
)
@click.option(
    "--clock-error", type=Number(0, MOST_CLOCK_ERROR), default=0.0, metavar="SECONDS", help="Each begins up to so late."
)
@click.option(
    "--noise",
    type=Number(0, MOST_NOISE),
    default=0.0,
    metavar="METRES",
    help="The controller is shown a position that is off by so much, the standard deviation along each axis.",
)
@click.option(
    "--latency",
    type=Number(0, MOST_LATENCY),
    default=0.0,
    metavar="SECONDS",
    help="It is shown position and velocity so late.",
)
@click.option(
    "--packet-loss",
    type=Number(0, MOST_LOSS),
    default=0.0,
    metavar="PERCENT",
    help="So many position updates are lost.",
)
@click.option(
    "--missed-start",
    type=Number(0, MOST_LOSS),
    default=0.0,
    metavar="PERCENT",
    help="So many vehicles never hear the start.",
)
@click.option(
    "--battery-sag",
    type=Number(0, MOST_LOSS),
    default=0.0,
    metavar="PERCENT",
    help="The most that a motor gives falls by so much until the end.",
)
@click.option(
    "--weak-motor",
    type=Number(0, MOST_LOSS),
    default=0.0,
    metavar="PERCENT",
    help="One motor of each gives up to so much less than it is told.",
)
@click.option(
    "--downwash",
    type=Number(0, MOST_DOWNWASH),
    default=0.0,
    metavar="FACTOR",
    help="Those below are pushed down by so many times a published model's force.",
)
@click.option(
    "--lose", type=loss, multiple=True, metavar="AGENT@T", help="The motors of an agent stop at second T. Repeatable."
)
@click.option("--seed", type=click.IntRange(0, LARGEST_SEED), default=0, show_default=True, metavar="N")
@click.option("--trace", type=file_to_write, metavar="FILE", help="Write the first flight's path: FILE.csv.")
@click.option("--plot", type=picture, metavar="FILE", help="Draw the flights: FILE.svg, FILE.png or FILE.pdf.")
@click.option("--quiet", is_flag=True, help="No progress.")
def command(
    path: Path,
    limits: tuple[tuple[str, str], ...],
    form: str,
    engine: str,
    trials: int,
    air: tuple[float, float],
    mass_error: float,
    start_error: float,
    clock_error: float,
    noise: float,
    latency: float,
    packet_loss: float,
    missed_start: float,
    battery_sag: float,
    weak_motor: float,
    downwash: float,
    lose: tuple[tuple[str, float], ...],
    seed: int,
    trace: Path | None,
    plot: Path | None,
    quiet: bool,
) -> Status:
    """Fly a compiled folder's polynomials in simulation, judge the mission on their path, and add it to the report."""
    from missionc.replay.simulate_folder import simulate
    from missionc.simulate.disturbance import UNDISTURBED, Disturbance
    from missionc.simulate.trials import Trial

    disturbance = Disturbance(
        wind=air[0],
        gust=air[1],
        mass=mass_error / 100,
        start=start_error,
        clock=clock_error,
        noise=noise,
        latency=latency,
        packets=packet_loss / 100,
        missed=missed_start / 100,
        battery=battery_sag / 100,
        motor=weak_motor / 100,
        downwash=downwash,
        lose=_once(lose),
    )
    if engine != ENGINES[0] and (trials > 1 or disturbance != UNDISTURBED):
        raise click.UsageError(f"{engine} flies once and undisturbed; leave `--engine` out for trials and disturbances")
    allowed = read_limits(limits)
    refused = _refused(path, trace, plot)
    if refused:
        say([refused], [], form, {"passed": None})
        return Status.MISSION_ERRORS
    trial = Trial(engine, trials, disturbance, seed, DRAWN if plot else 1)
    with _progress(quiet or form == "json", trials) as listen:
        simulated = simulate(path, trial, allowed, listen)
    findings = list(simulated.findings)
    document = flight_summary.simulated_document(simulated)
    if simulated.opened and simulated.trials:
        from missionc.output.documents.simulation_json import simulation_json
        from missionc.replay.render_report import add_simulation

        flown = simulation_json(simulated.opened.mission, document, simulated.trials.flown)
        findings += add_simulation(path, flown, allowed)
    if (trace or plot) and simulated.opened and simulated.trials:
        from missionc.output.folder.write_file import write_file
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


def _refused(path: Path, trace: Path | None, plot: Path | None) -> Diagnostic | None:
    """What forbids writing, said before anything is flown."""
    if not (trace or plot):
        return None
    from missionc.output.folder.overlap import Output, overlapping
    from missionc.output.folder.write_file import refuse_file
    from missionc.output.plot.plot import missing

    outputs = [Output(flag, file) for flag, file in (("--trace", trace), ("--plot", plot)) if file]
    return (
        overlapping(outputs, [path])
        or (plot and (missing() or refuse_file(plot)))
        or (trace and refuse_file(trace))
        or None
    )


@contextmanager
def _progress(silent: bool, trials: int) -> Iterator[Callable[[int], None]]:
    """Where to say how many flights are over: a line on a terminal, nowhere else."""
    if silent or not sys.stderr.isatty():
        yield lambda done: None
        return
    with ProgressLine(sys.stderr) as line:
        line.say("flying")
        yield lambda done: line.say(f"flying: {done}/{trials} flights")
