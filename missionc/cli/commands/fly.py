"""``missionc fly FOLDER --in simulation``: closed loop of flight, monitoring and replanning in simulation."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path

import click

from missionc.base.units import Seconds
from missionc.cli import options
from missionc.cli.exit_status import Status, say, say_line
from missionc.cli.option_groups import GroupedCommand
from missionc.cli.progress import ProgressLine
from missionc.flight.simulation.trial_bounds import LARGEST_SEED

MOST_FLIGHTS = 10_000


@click.command("fly", cls=GroupedCommand)
@click.argument("path", type=options.folder, shell_complete=options.folders, metavar="FOLDER")
@click.option(
    "--in",
    "where",
    type=click.Choice(["simulation"]),
    required=True,
    help="Environment of the flight. `simulation` is the only choice.",
)
@click.option(
    "--scenario",
    type=options.existing,
    shell_complete=options.files,
    metavar="FILE",
    help="Read disturbances and events of the flight from a TOML file.",
)
@click.option(
    "--flights",
    type=options.Count(1, MOST_FLIGHTS),
    default=1,
    show_default=True,
    metavar="N",
    help="Number of flights.",
)
@options.seed(LARGEST_SEED)
@click.option(
    "--within",
    type=options.Number(0.1, 600),
    default=3,
    show_default=True,
    metavar="SECONDS",
    help="Time from an event to the start of the new plan.",
)
@click.option("--no-replan", is_flag=True, help="Monitor the flight without replanning.")
@options.output("Report of the flights. [default: FOLDER-flights.html beside the folder]", page=True)
@click.option(
    "--trace",
    type=options.file_to_write,
    metavar="FILE",
    help="Write the trajectory of the first flight to a CSV file.",
)
@click.option("--page", is_flag=True, help="Show the first flight in the browser while it is simulated.")
@click.option(
    "--pace",
    type=options.Number(0.1, 100),
    default=1,
    show_default=True,
    metavar="N",
    help="Playback speed on the page, as a multiple of real time.",
)
@click.option("--no-open", is_flag=True, help="Print the address of the page without opening a browser.")
@options.quiet_progress
@options.limits_and_form
def command(
    path: Path,
    where: str,
    scenario: Path | None,
    flights: int,
    seed: int,
    within: float,
    no_replan: bool,
    output: Path | None,
    trace: Path | None,
    page: bool,
    pace: float,
    no_open: bool,
    quiet: bool,
    limits: tuple[tuple[str, str], ...],
    form: str,
) -> Status:
    """Fly a plan in simulation, monitor it and replan on events."""
    assert where == "simulation", "a flight in another environment"
    from missionc.cli.fly_folder import flights_page, open_folder, paths_table, read_events
    from missionc.cli.loop_summary import loop_lines
    from missionc.cli.page_to_write import refuse_page
    from missionc.output.folder.overlap import WrittenPath
    from missionc.output.folder.write_folder import beside, refuse_file, write_file
    from missionc.tools.closed_loop.fly_loop import LoopFlight, fly_loop, nobody
    from missionc.tools.closed_loop.loop_record import ToldPositions, loop_document, loop_flights, without_path

    allowed = options.read_limits(limits)
    target = output or beside(options.named(path), "-flights.html")
    read = [path, *([scenario] if scenario else [])]
    traces = [WrittenPath("--trace", trace)] if trace else []
    refused = refuse_page(target, output is not None, read, traces) or (refuse_file(trace) if trace else None)
    opened = [refused] if refused else open_folder(path, allowed)
    happening = opened if isinstance(opened, list) else read_events(scenario, opened.flying, allowed)
    if isinstance(opened, list) or isinstance(happening, list):
        findings = opened if isinstance(opened, list) else happening
        assert isinstance(findings, list)
        say(findings, [], form, {"passed": None})
        return Status.MISSION_ERRORS
    flying = opened.flying
    mission, kernel = flying.checked.valid_mission, flying.checked.valid_kernel
    shown = None
    if page:
        from missionc.cli.browser import said
        from missionc.cli.fly_folder import ShownLoop

        shown = ShownLoop(mission, kernel, flying.trace, pace)
    flown: list[LoopFlight] = []
    told = ToldPositions(shown.listen if shown else nobody)
    silent = quiet or form == "json" or not sys.stderr.isatty()
    with shown or nullcontext(), nullcontext() if silent else ProgressLine(sys.stderr) as line:
        if shown:
            say_line(said(shown.address, no_open, shown.address, "live page"))
            sys.stdout.flush()
        for number in range(flights):
            listen = nobody if number else told.listen
            within_seconds, seeded = Seconds(within), seed + number
            each = fly_loop(flying, happening, seeded, within_seconds, allowed, replans=not no_replan, listen=listen)
            flown.append(without_path(each) if number else each)
            if line:
                line.say(f"simulating flights: {number + 1} of {flights} done")
            if shown and number == 0:
                shown.over(flown[0])
        drawn = flights_page(opened, loop_flights(mission, happening, flown, told, not no_replan))
        wrong = write_file(target, drawn) or (write_file(trace, paths_table(mission, flown[0])) if trace else None)
        document = loop_document(mission, happening, flown, not no_replan)
        lines = [*loop_lines(mission, flown, not no_replan), *([] if wrong else [f"report: {target}"])]
        say([wrong] if wrong else [], lines, form, {**document, "output": None if wrong else str(target)})
        if shown and flights == 1:
            shown.wait()
    if wrong:
        return Status.MISSION_ERRORS
    return Status.DONE if document["passed"] else Status.VIOLATED
