"""``missionc compile FILE``: planning of a mission, and the folder with its verified plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from missionc.backends.options import TRANSPORT_PRESETS, Options
from missionc.cli import options, stage_names
from missionc.cli.compile_request import CompileRequest, run_request
from missionc.cli.exit_status import Status
from missionc.cli.option_groups import GroupedCommand
from missionc.cli.options import (
    Pairs,
    existing,
    file_to_write,
    files,
    moments,
    of_mission,
    read_limits,
    several_of,
    staged,
)
from missionc.output.folder.file_names import MOST_ALTERNATIVES
from missionc.output.plot.figure_request import KINDS, MAP, MAPS, FigureRequest

PLANNING = ("solver", "require_solver", "preset", "samples", "device", "margin", "processes", "stretch")
"""Options that control the search for a plan, shared by all planning commands."""


@click.command("compile", cls=GroupedCommand)
@click.argument("file", type=existing, shell_complete=files)
@of_mission
@options.output("Plan folder to write. [default: build/MISSION]")
@options.force
@options.vehicle
@options.poses
@options.backend
@options.of_a_plan(*PLANNING)
@options.set_values
@options.seed()
@options.time_limit("Stop after this time and return the best plan found.")
@options.memory_limit
@click.option(
    "--checkpoint",
    type=file_to_write,
    metavar="FILE",
    help="Save the state of the search to a file at intervals.",
)
@click.option(
    "--resume",
    type=existing,
    shell_complete=files,
    metavar="FILE",
    help="Continue an interrupted search from its checkpoint file.",
)
@click.option(
    "--emit",
    "emitted",
    type=staged,
    shell_complete=several_of(lambda: stage_names.ALL),
    multiple=True,
    metavar="STAGE[,STAGE...]",
    help=f"Print intermediate representations: {', '.join(stage_names.ALL)}. No folder is written without `-o`.",
)
@options.exported("Also export the flight to these formats. `missionc export --list` lists all formats.")
@click.option("--timings", is_flag=True, help="Print the time of each stage of the compiler.")
@options.plot("Plot the plan")
@click.option(
    "--plot-kind",
    type=click.Choice(KINDS),
    default=MAP,
    show_default=True,
    help="Content of the plot: a map, a map with the roadmap, or a chart over time.",
)
@click.option(
    "--at", type=moments, default="", metavar="SECONDS[,SECONDS...]", help="Plot one map for each given time."
)
@options.plot_width
@options.of_a_plan("certify")
@options.between_steps
@click.option(
    "--alternatives",
    type=options.Count(1, MOST_ALTERNATIVES),
    default=1,
    show_default=True,
    metavar="K",
    help="Write up to K plans that differ in a disjunct of an `or`, the order of tasks, or a homotopy class.",
)
@options.explain_limit
@options.quiet
@options.verbose
@options.watch
@options.no_open
@click.pass_obj
def command(
    began: float | None,
    /,
    file: Path,
    overrides: Pairs,
    settings: Pairs,
    limits: Pairs,
    vehicle: str | None,
    emitted: tuple[tuple[str, ...], ...],
    exported: tuple[tuple[str, ...], ...],
    plot: Path | None,
    plot_kind: str,
    at: tuple[float, ...],
    plot_width: str | None,
    continuous: bool,
    at_steps: bool,
    watch: bool,
    no_open: bool,
    **given: Any,
) -> Status:
    """Plan a mission, verify the plan and write its files."""
    drawn = {"--plot-kind": plot_kind != MAP, "--at": bool(at), "--plot-width": plot_width is not None}
    for flag, used in drawn.items():
        if used and plot is None:
            raise click.UsageError(f"`{flag}` needs a plot; add `--plot FILE.svg`")
    if at and plot_kind not in MAPS:
        raise click.UsageError(f"`--at` needs a map, not `--plot-kind {plot_kind}`; remove one of them")
    wanted = stage_names.in_order(stage for group in emitted for stage in group)
    captures = frozenset(wanted) & frozenset(stage_names.BY_A_BACKEND)
    chosen = Options(captures=captures, **{name: given.pop(name) for name in (*PLANNING, "certify")})
    if chosen.samples is not None and chosen.preset == TRANSPORT_PRESETS[0]:
        raise click.UsageError(
            f"the preset `{chosen.preset}` uses no `--samples`; "
            f"add `--preset` with one of {', '.join(TRANSPORT_PRESETS[1:])}"
        )
    throughout = options.continuous_time(continuous, at_steps)
    if given["alternatives"] > 1 and chosen.stretch != 1:
        raise click.UsageError("`--alternatives` and `--stretch` exclude each other; remove one of them")
    if watch and (given["form"] != "text" or emitted or given["resume"]):
        raise click.UsageError(
            "`--watch` prints text only and does not end; remove `--format`, `--emit` and `--resume`"
        )
    if no_open and not watch:
        raise click.UsageError("`--no-open` has no effect without `--watch`; remove it")
    request = CompileRequest(
        file,
        overrides=(*overrides, *settings),
        limits=read_limits(limits),
        vehicle=vehicle or "",
        options=chosen,
        throughout=throughout,
        exports=tuple(name for group in exported for name in group),
        wanted=wanted,
        plot=plot,
        figure=FigureRequest(plot_kind, at, plot_width or ""),
        began=None if watch else began,
        **given,
    )
    if watch:
        from missionc.cli.watch.loop import watch as again  # only on request

        return again(request, no_open)
    return run_request(request).status
