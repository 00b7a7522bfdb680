"""``missionc compile FILE``: a verified plan, in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from missionc.backends.options import TRANSPORT_PRESETS, Options
from missionc.base.units import Seconds
from missionc.cli import options, stage_names
from missionc.cli.compile_request import CompileRequest, run_request
from missionc.cli.exit_status import Status
from missionc.cli.options import (
    Number,
    Pairs,
    existing,
    export_names,
    exports,
    file_to_write,
    files,
    folder_to_write,
    moments,
    of_mission,
    picture,
    read_limits,
    several_of,
    staged,
)
from missionc.compiler import driver
from missionc.output.folder.file_names import MOST_ALTERNATIVES
from missionc.output.plot.figure_request import KINDS, MAP, MAPS, WIDTHS, FigureRequest

PLANNING = ("solver", "require_solver", "preset", "samples", "device", "margin", "processes", "stretch")
"""Options of a plan that say how it is found, of every command that plans."""


@click.command("compile")
@click.argument("file", type=existing, shell_complete=files)
@of_mission
@click.option(
    "-o", "--output", type=folder_to_write, metavar="FOLDER", help="The folder to write; build/MISSION if left out."
)
@click.option("--force", is_flag=True, help="Replace the folder if it exists.")
@options.vehicle
@options.poses
@options.backend
@options.of_a_plan(*PLANNING)
@options.set_values
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, metavar="N")
@click.option(
    "--time-limit",
    type=Number(min=0, min_open=True, max=1e9),
    default=float(driver.DEFAULT_TIME_LIMIT),
    show_default=True,
    metavar="SECONDS",
    help="End after so long, with the best plan so far.",
)
@options.memory_limit
@click.option(
    "--checkpoint",
    type=file_to_write,
    metavar="FILE",
    help="Keep what the search knows in a file, as it goes on.",
)
@click.option(
    "--resume", type=existing, shell_complete=files, metavar="FILE", help="Go on from what an interrupted run kept."
)
@click.option(
    "--emit",
    "emitted",
    type=staged,
    shell_complete=several_of(lambda: stage_names.ALL),
    multiple=True,
    metavar="STAGE[,STAGE...]",
    help=f"Print stages and go no further: {', '.join(stage_names.ALL)}. With -o the folder is written all the same.",
)
@click.option(
    "--export",
    "exported",
    type=export_names,
    shell_complete=several_of(exports),
    multiple=True,
    metavar="NAME[,NAME...]",
    help="Write the flight in other forms as well; `missionc export --list` names them.",
)
@click.option("--timings", is_flag=True, help="Say how long each stage took.")
@click.option("--plot", type=picture, metavar="FILE", help="Draw the plan: FILE.svg, FILE.png or FILE.pdf.")
@click.option(
    "--plot-kind",
    type=click.Choice(KINDS),
    default=MAP,
    show_default=True,
    help="Draw a map, with the roadmap of the plan too; or robustness, distances or who does what over time.",
)
@click.option(
    "--at", type=moments, default="", metavar="SECONDS[,SECONDS...]", help="Draw a map at each of these moments."
)
@click.option("--plot-width", type=click.Choice([*WIDTHS]), help="Draw as wide as a paper's column, or as two.")
@options.of_a_plan("certify")
@click.option("--continuous", is_flag=True, help="Refuse a plan whose requirements fail between the steps.")
@click.option(
    "--at-steps", is_flag=True, help="Take a plan whose requirements hold at the steps, without asking for more."
)
@click.option(
    "--alternatives",
    type=click.IntRange(1, MOST_ALTERNATIVES),
    default=1,
    show_default=True,
    metavar="K",
    help="Plan so many that differ: another option, order or side of an obstacle.",
)
@options.explain_limit
@click.option("--quiet", is_flag=True, help="No summary and no progress.")
@options.verbose
@options.watch
@options.no_open
@click.pass_obj
def command(
    began: float | None,
    /,
    file: Path,
    overrides: Pairs,
    limits: Pairs,
    form: str,
    output: Path | None,
    force: bool,
    vehicle: str | None,
    poses: Path | None,
    backend: str,
    settings: Pairs,
    seed: int,
    time_limit: float,
    memory_limit: int,
    checkpoint: Path | None,
    resume: Path | None,
    emitted: tuple[tuple[str, ...], ...],
    exported: tuple[tuple[str, ...], ...],
    timings: bool,
    plot: Path | None,
    plot_kind: str,
    at: tuple[float, ...],
    plot_width: str | None,
    continuous: bool,
    at_steps: bool,
    alternatives: int,
    explain_limit: float,
    quiet: bool,
    verbose: bool,
    watch: bool,
    no_open: bool,
    **of_a_plan: Any,
) -> Status:
    """Turn a mission into a verified plan and its files."""
    drawn = {"--plot-kind": plot_kind != MAP, "--at": bool(at), "--plot-width": plot_width is not None}
    for flag, given in drawn.items():
        if given and plot is None:
            raise click.UsageError(f"`{flag}` says how to draw; add `--plot FILE.svg`")
    if at and plot_kind not in MAPS:
        raise click.UsageError(f"`--at` is for maps, and `{plot_kind}` is drawn over time; leave one of them out")
    wanted = stage_names.in_order(stage for group in emitted for stage in group)
    captures = frozenset(wanted) & frozenset(stage_names.BY_A_BACKEND)
    chosen = Options(captures=captures, **of_a_plan)
    if chosen.samples is not None and chosen.preset == TRANSPORT_PRESETS[0]:
        raise click.UsageError(
            f"`--samples` is for presets that transport trajectories, and `{chosen.preset}` does not; "
            f"add `--preset` with one of {', '.join(TRANSPORT_PRESETS[1:])}"
        )
    throughout = options.continuous_time(continuous, at_steps)
    if alternatives > 1 and chosen.stretch != 1:
        raise click.UsageError("`--alternatives` plans at the mission's own pace; leave `--stretch` out")
    if watch and (form != "text" or emitted or resume):
        raise click.UsageError("`--watch` goes on and on, in words; leave `--format`, `--emit` and `--resume` out")
    if no_open and not watch:
        raise click.UsageError("`--no-open` is for `--watch`, which opens the report")
    request = CompileRequest(
        file,
        overrides=(*overrides, *settings),
        limits=read_limits(limits),
        backend=backend,
        vehicle=vehicle or "",
        poses=poses,
        options=chosen,
        seed=seed,
        time_limit=Seconds(time_limit),
        memory_limit=memory_limit,
        explain_limit=Seconds(explain_limit),
        throughout=throughout,
        alternatives=alternatives,
        exports=tuple(name for group in exported for name in group),
        checkpoint=checkpoint,
        resume=resume,
        wanted=wanted,
        output=output,
        force=force,
        plot=plot,
        figure=FigureRequest(plot_kind, at, plot_width or ""),
        form=form,
        quiet=quiet,
        verbose=verbose,
        timings=timings,
        began=None if watch else began,
    )
    if watch:
        from missionc.cli.watch.loop import watch as again  # for those who ask for it

        return again(request, no_open)
    return run_request(request).status
