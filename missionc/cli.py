"""The commands: flags in, files and words out. Nothing about missions is decided here.

Diagnostics go to standard error, results to standard output; with ``--format
json`` standard output is one document that holds the diagnostics too.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import assert_never

import click

from missionc import driver, flags, stages, summary
from missionc.answers import Status, say
from missionc.backends.api import DEVICES, PRESETS, Budget, Impossible, NotFound, Options, Progress, ignore
from missionc.diagnostics.code import INTERNAL
from missionc.diagnostics.model import Diagnostic, has_errors
from missionc.flags import existing, export_names, files, of_mission, read_limits, stage_names
from missionc.keeping import KeptRun
from missionc.progress import ProgressLine
from missionc.results import Checked, Compiled, Refused, Unverified, Verified
from missionc.units import Seconds
from missionc.version import __version__

Pairs = tuple[tuple[str, str], ...]

MODULES = ("explain", "export", "fmt", "report", "simulate", "vehicles", "verify")
"""Commands with a module of their own."""


def main(arguments: list[str] | None = None) -> int:
    """Run one command and return its exit status; nothing comes out but ``Stopped``, a traceback least of all."""
    words = sys.argv[1:] if arguments is None else arguments
    try:
        return int(commands.main(args=words, prog_name="missionc", standalone_mode=False) or Status.DONE)
    except click.exceptions.Exit as left:
        return left.exit_code
    except click.ClickException as error:
        error.show()
        return Status.USAGE
    except Exception as error:
        if os.environ.get("MISSIONC_TRACEBACK"):
            raise
        say([_defect(error)], [], "json" if "json" in words or "--format=json" in words else "text", {})
        return Status.DEFECT


class Commands(click.Group):
    """Commands of a module each, in ``missionc.commands``, are loaded when they are called."""

    def list_commands(self, context: click.Context) -> list[str]:
        return sorted([*super().list_commands(context), *MODULES])

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in MODULES:
            return super().get_command(context, name)
        command = import_module(f"missionc.commands.{name}").command
        assert isinstance(command, click.Command)
        return command


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, message="missionc %(version)s")
def commands() -> None:
    """A compiler for multi-robot missions.

    A mission says what must be true; trajectories that provably do it come back.
    """


@commands.command()
@click.argument("missions", nargs=-1, required=True, type=existing, shell_complete=files, metavar="FILE...")
@of_mission
def check(missions: tuple[Path, ...], overrides: Pairs, limits: Pairs, form: str) -> Status:
    """Report every problem of the missions; solve nothing."""
    allowed = read_limits(limits)
    results = [driver.check(file, overrides=dict(overrides), limits=allowed) for file in missions]
    findings = [finding for checked in results for finding in checked.findings]
    lines = [f"{checked.file}: {summary.counts(checked.findings)}" for checked in results]
    say(findings, lines, form, summary.checked_document(results))
    return Status.MISSION_ERRORS if has_errors(findings) else Status.DONE


@commands.command()
@click.argument("file", type=existing, shell_complete=files)
@of_mission
@click.option("-o", "--output", type=click.Path(path_type=Path), help="The folder to write; build/MISSION if left out.")
@click.option("--force", is_flag=True, help="Replace the folder if it exists.")
@click.option("--backend", type=click.Choice(["auto", "smt", "clot", "hybrid"]), default="auto", show_default=True)
@click.option("--solver", type=click.Choice(["z3", "cadical", "race"]), default="z3", show_default=True)
@click.option("--preset", type=click.Choice(PRESETS), default=PRESETS[0], show_default=True, help="How clot plans.")
@click.option(
    "--samples",
    type=click.IntRange(1, 100_000),
    metavar="N",
    help="Trajectories that presets but `sketch` optimise at once.",
)
@click.option(
    "--device",
    type=click.Choice(DEVICES),
    default=DEVICES[0],
    show_default=True,
    help="Where presets but `sketch` optimise their trajectories.",
)
@click.option(
    "--margin",
    type=click.FloatRange(min=0, max=1e3),
    metavar="METRES",
    help="Keep every requirement by so much where that is possible; its vehicles' tracking margin if left out.",
)
@click.option(
    "--processes",
    type=click.IntRange(1, 256),
    default=1,
    show_default=True,
    metavar="N",
    help="Child processes of clot and hybrid; the plan is the same.",
)
@click.option(
    "--stretch", type=click.FloatRange(1, 1000), default=1.0, metavar="S", help="Fly the plan S times slower."
)
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, metavar="N")
@click.option(
    "--time-limit",
    type=click.FloatRange(min=0, min_open=True, max=1e9),
    default=float(driver.DEFAULT_TIME_LIMIT),
    show_default=True,
    metavar="SECONDS",
    help="End the search after so long, with the best plan so far.",
)
@flags.memory_limit
@click.option(
    "--checkpoint",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Keep what the search knows in a file, as it goes on.",
)
@click.option("--resume", type=existing, metavar="FILE", help="Go on from what an interrupted run kept.")
@click.option(
    "--emit",
    "asked",
    type=stage_names,
    multiple=True,
    metavar="STAGE[,STAGE...]",
    help=f"Print stages and go no further: {', '.join(stages.ALL)}. With -o the folder is written all the same.",
)
@click.option(
    "--export",
    "exported",
    type=export_names,
    multiple=True,
    metavar="NAME[,NAME...]",
    help="Write the flight in other forms as well; `missionc export --list` names them.",
)
@click.option("--timings", is_flag=True, help="Say how long each stage took.")
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False), help="Draw the plan: FILE.svg or FILE.png.")
@click.option("--certify", is_flag=True, help="Leave the CNF and a DRAT proof beside an `impossible`.")
@click.option("--continuous", is_flag=True, help="Refuse a plan whose requirements fail between the steps.")
@flags.explain_limit
@click.option("--quiet", is_flag=True, help="No summary and no progress.")
def compile(
    file: Path,
    overrides: Pairs,
    limits: Pairs,
    form: str,
    output: Path | None,
    force: bool,
    backend: str,
    solver: str,
    preset: str,
    samples: int | None,
    device: str,
    margin: float | None,
    processes: int,
    stretch: float,
    seed: int,
    time_limit: float,
    memory_limit: int,
    checkpoint: Path | None,
    resume: Path | None,
    asked: tuple[tuple[str, ...], ...],
    exported: tuple[tuple[str, ...], ...],
    timings: bool,
    plot: Path | None,
    certify: bool,
    continuous: bool,
    explain_limit: float,
    quiet: bool,
) -> Status:
    """Turn a mission into a verified plan and its files."""
    if plot and plot.suffix not in (".svg", ".png"):
        raise click.BadParameter(f"`{plot}` ends neither in .svg nor in .png", param_hint="--plot")
    if samples is not None and preset == PRESETS[0]:
        raise click.UsageError(
            f"`--samples` is for presets that transport trajectories, and `{preset}` does not; "
            f"add `--preset` with one of {', '.join(PRESETS[1:])}"
        )
    allowed = read_limits(limits)
    wanted = stages.in_order(stage for group in asked for stage in group)
    deadline = time.monotonic() + time_limit
    with _progress(quiet or form == "json", deadline) as listen:
        checked = driver.check(file, overrides=dict(overrides), backend=backend, limits=allowed)
        if wanted and not output and not plot and set(wanted) <= set(stages.BEFORE_PLANNING):
            compiled = Compiled(checked, Refused(), checked.findings, checked.seconds)
            answer = Answer(compiled, Status.DONE if checked.ok else Status.MISSION_ERRORS)
        else:
            captures = frozenset(wanted) & frozenset(stages.BY_A_BACKEND)
            options = Options(solver, certify, captures, preset, samples, device, margin, processes, stretch)
            budget = Budget(deadline, memory_limit, seed, allowed, listen)
            folder = None if wanted and not output else output or _default_folder(checked)
            exports = tuple(name for group in exported for name in group)
            kept = KeptRun(checkpoint, resume)
            limit = Seconds(explain_limit)
            answer = _plan(checked, options, budget, folder, force, plot, exports, kept, continuous, limit)
    compiled = answer.compiled
    lines = [] if quiet or wanted else summary.compiled_lines(compiled, answer.output)
    lines += summary.timing_lines(compiled.seconds) if timings else []
    texts = stages.of_compiled(compiled, wanted)
    document = summary.compiled_document(compiled, answer.output, texts)
    say(compiled.findings, [*_stage_lines(texts), *lines], form, document)
    return answer.status


@dataclass(frozen=True, slots=True)
class Answer:
    """What ``compile`` came to; ``output`` is the folder written, empty where none was."""

    compiled: Compiled
    status: Status
    output: str = ""


def _plan(
    checked: Checked,
    options: Options,
    budget: Budget,
    folder: Path | None,
    force: bool,
    plot: Path | None,
    exports: tuple[str, ...],
    kept: KeptRun,
    continuous: bool,
    explain_limit: Seconds,
) -> Answer:
    """Plan and write. What can be known to forbid writing is said before any planning."""
    from missionc.emit.folder import refuse
    from missionc.emit.plot import missing
    from missionc.export import FORMATS

    absent = next(filter(None, (FORMATS[name].missing() for name in exports)), None)
    refused = (plot and missing()) or absent or (folder and refuse(folder, force))
    if refused and checked.ok:
        return _refused(Compiled(checked, Refused(), checked.findings, checked.seconds), refused)
    checkpoints = kept.checkpoints(budget.limits)
    if isinstance(checkpoints, Diagnostic):
        return _refused(Compiled(checked, Refused(), checked.findings, checked.seconds), checkpoints)
    compiled = driver.plan(checked, options, budget, checkpoints, exports, continuous, explain_limit)
    answer = _answer(compiled, folder, force, plot)
    if kept.wrong:
        findings = (*answer.compiled.findings, kept.wrong)
        return Answer(replace(answer.compiled, findings=findings), Status.MISSION_ERRORS, answer.output)
    return answer


def _answer(compiled: Compiled, folder: Path | None, force: bool, plot: Path | None) -> Answer:
    """What was planned, written."""
    match compiled.outcome:
        case Refused():
            return Answer(compiled, Status.MISSION_ERRORS)
        case Unverified():
            return Answer(compiled, Status.NOT_VERIFIED)
        case NotFound():
            return _write(compiled, Status.UNDECIDED, folder, force, None)
        case Impossible():
            return _write(compiled, Status.IMPOSSIBLE, folder, force, None)
        case Verified():
            status = Status.MISSION_ERRORS if has_errors(list(compiled.findings)) else Status.DONE
            return _write(compiled, status, folder, force, plot)
        case _:
            assert_never(compiled.outcome)


def _write(
    compiled: Compiled,
    status: Status,
    folder: Path | None,
    force: bool,
    plot: Path | None,
) -> Answer:
    """The folder, whole or not at all; then the map."""
    from missionc.emit.folder import write_file, write_folder
    from missionc.emit.plot import plot as draw

    mission = compiled.checked.mission
    picture: bytes | Diagnostic = b""
    if plot and mission and isinstance(compiled.outcome, Verified):
        plan = compiled.outcome.plan
        picture = draw(mission, plan.trace, plan.backend, plot.suffix[1:])
    if isinstance(picture, Diagnostic):
        return _refused(compiled, picture)
    written = folder if compiled.files else None
    wrong = write_folder(written, compiled.files, force) if written else None
    if wrong:
        return _refused(compiled, wrong)
    wrong = write_file(plot, picture) if plot and picture else None
    if wrong:
        compiled, status = replace(compiled, findings=(*compiled.findings, wrong)), Status.MISSION_ERRORS
    return Answer(compiled, status, str(written or ""))


def _refused(compiled: Compiled, finding: Diagnostic) -> Answer:
    """The end of a compilation whose output cannot be written."""
    findings = (*compiled.findings, finding)
    return Answer(replace(compiled, outcome=Refused(), findings=findings), Status.MISSION_ERRORS)


@commands.command()
@click.argument("file", type=existing, shell_complete=files)
@click.argument("trace", type=existing, shell_complete=files)
@of_mission
@click.option("--continuous", is_flag=True, help="Judge what happens between the steps too.")
def monitor(file: Path, trace: Path, overrides: Pairs, limits: Pairs, form: str, continuous: bool) -> Status:
    """Judge a trace: a plan.json, or a CSV file with agent,t,x,y[,z]."""
    judged = driver.monitor(file, trace, overrides=dict(overrides), limits=read_limits(limits), continuous=continuous)
    say(judged.findings, summary.monitored_lines(judged), form, summary.monitored_document(judged))
    if not judged.ok:
        return Status.MISSION_ERRORS
    return Status.DONE if judged.satisfied else Status.VIOLATED


@contextmanager
def _progress(silent: bool, deadline: float) -> Iterator[Callable[[Progress], None]]:
    """Where to say how far things are: a line on a terminal, nowhere else."""
    if silent or not sys.stderr.isatty():
        yield ignore
        return
    with ProgressLine(sys.stderr, deadline) as line:
        yield line.listen


def _default_folder(checked: Checked) -> Path:
    return Path("build") / (checked.mission.name if checked.mission else "mission")


def _stage_lines(texts: list[tuple[str, str]]) -> list[str]:
    """The stages asked for; with a heading each where there are several."""
    if len(texts) == 1:
        return [texts[0][1].rstrip("\n")]
    return [line for stage, text in texts for line in (f"# {stage}", text.rstrip("\n"), "")]


def _defect(error: Exception) -> Diagnostic:
    place = error.__traceback__
    while place and place.tb_next:
        place = place.tb_next
    where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}" if place else "nowhere"
    return Diagnostic(
        INTERNAL,
        f"a defect of the compiler: {type(error).__name__} at {where}",
        None,
        notes=(str(error)[:200],) if str(error) else (),
        help="report it with the mission, the command and `missionc --version`; MISSIONC_TRACEBACK=1 shows more",
    )
