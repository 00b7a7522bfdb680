"""Compilation by a command: planning, verification, writing and reporting of one mission.

in   CompileRequest
out  CompileResult
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, assert_never

from missionc.backends.api import Budget, Impossible, NotFound, Progress, Scope
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.defect import improvement_failed, later_not_written
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.signals import reraise_stop
from missionc.base.source import Source
from missionc.base.supervision import tell_kept
from missionc.base.units import Seconds
from missionc.cli import emit_stages, stage_names, summary
from missionc.cli.exit_status import Status, say
from missionc.cli.progress import shown
from missionc.compiler import driver
from missionc.compiler.checkpoints import KeptRun
from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import NO_EXPLANATION, PlanRequest
from missionc.compiler.results import Compiled, InvalidMission, Unverified, Verified
from missionc.output.plot.figure_request import FigureRequest

if TYPE_CHECKING:
    from missionc.output.folder.overlap import WrittenPath


@dataclass(frozen=True, slots=True)  # ``Record`` takes no ``KW_ONLY``
class CompileRequest:
    """Parsed flags of ``compile``: input, options and outputs."""

    file: Path | Source
    """Mission file, or its text with the name of a file that need not exist."""
    _: KW_ONLY
    overrides: tuple[tuple[str, str], ...] = ()
    limits: Limits = field(default_factory=Limits)
    backend: str = "auto"
    vehicle: str = ""
    """Vehicle profile of teams that name none; can be empty."""
    poses: Path | None = None
    """File with the measured positions of the agents; None if they take off from their starts."""
    options: Options = field(default_factory=Options)
    seed: int = 0
    time_limit: Seconds = driver.DEFAULT_TIME_LIMIT
    memory_limit: int = driver.DEFAULT_MEMORY_LIMIT
    explain_limit: Seconds = NO_EXPLANATION
    throughout: ContinuousTime = ContinuousTime.WANTED
    alternatives: int = 1
    """Number of different plans to find."""
    exports: tuple[str, ...] = ()
    checkpoint: Path | None = None
    resume: Path | None = None
    wanted: tuple[str, ...] = ()
    """Names of the stages to print, in the order of the pipeline."""
    output: Path | None = None
    """Folder to write; None for one named after the mission."""
    force: bool = False
    plot: Path | None = None
    figure: FigureRequest = field(default_factory=FigureRequest)
    """Contents of the picture that ``plot`` requests."""
    form: str = "text"
    quiet: bool = False
    verbose: bool = False
    """True for a complete summary instead of a short one."""
    timings: bool = False
    began: float | None = None
    """Start of the time limit on the clock of ``time.monotonic``; None for the start of the work."""

    @property
    def name(self) -> str:
        """Name of the mission's file in messages."""
        return self.file.name if isinstance(self.file, Source) else str(self.file)

    @property
    def deadline(self) -> float:
        """Deadline on the clock of ``time.monotonic``, from now unless the work began earlier."""
        return (time.monotonic() if self.began is None else self.began) + self.time_limit

    def plan_request(self, budget: Budget) -> PlanRequest:
        """Request for a plan, without checkpoints and output folder."""
        return PlanRequest(
            budget,
            self.options,
            exports=self.exports,
            continuous_time=self.throughout,
            explain_limit=self.explain_limit,
            alternatives=self.alternatives,
        )

    @property
    def writes(self) -> bool:
        """Return whether a folder will be written: if stages are printed, only with an explicit folder."""
        return not self.wanted or self.output is not None


class CompileResult(Record):
    """Result of a compilation, its exit status, and the path of the written folder, or an empty text."""

    compiled: Compiled
    status: Status
    output: str = ""


def run_request(request: CompileRequest) -> CompileResult:
    """Compile a mission, write its folder, and print the result."""
    deadline = request.deadline
    began = deadline - request.time_limit
    with shown(request.quiet or request.form == "json") as listen:
        answer = carry_out(request, deadline, listen)
    compiled = answer.compiled
    seconds = Seconds(time.monotonic() - began)
    silent = request.quiet or bool(request.wanted)
    lines = [] if silent else summary.compiled_lines(compiled, answer.output, seconds, request.verbose)
    lines += summary.timing_lines(compiled.seconds) if request.timings else []
    asked = request.plan_request(Budget(deadline, seed=request.seed))
    texts = emit_stages.of_compiled(compiled, request.wanted, asked)
    document = summary.compiled_document(compiled, answer.output, texts)
    say(compiled.findings, [*_stage_lines(texts), *lines], request.form, document)
    return answer


def check(request: CompileRequest) -> Checked:
    """Result of the front end for the requested mission."""
    return driver.check(
        request.file,
        overrides=dict(request.overrides),
        backend=request.backend,
        limits=request.limits,
        vehicle=request.vehicle,
        poses=request.poses,
    )


def folder_of(request: CompileRequest, checked: Checked) -> Path:
    """Path of the folder to which the plan of a checked mission is written."""
    return request.output or Path("build") / (checked.mission.name if checked.mission else "mission")


def carry_out(request: CompileRequest, deadline: float, listen: Callable[[Progress], None]) -> CompileResult:
    """Compile a mission and write its folder, without printing.

    Args:
        request: input, options and outputs.
        deadline: end of the time limit on the clock of ``time.monotonic``.
        listen: called with the progress.
    """
    budget = Budget(deadline, request.memory_limit, request.seed, request.limits, listen)
    checked = driver.check_within(
        budget,
        request.file,
        overrides=dict(request.overrides),
        backend=request.backend,
        vehicle=request.vehicle,
        poses=request.poses,
    )
    if isinstance(checked, Compiled):
        return CompileResult(checked, Status.UNDECIDED)
    if (
        request.wanted
        and not request.writes
        and not request.plot
        and set(request.wanted) <= set(stage_names.BEFORE_PLANNING)
    ):
        compiled = Compiled(checked, InvalidMission(), checked.findings, checked.seconds)
        return CompileResult(compiled, Status.DONE if checked.ok else Status.MISSION_ERRORS)
    folder = folder_of(request, checked) if request.writes else None
    return _planned(request, checked, folder, budget)


def _planned(request: CompileRequest, checked: Checked, folder: Path | None, budget: Budget) -> CompileResult:
    """Plan a checked mission and write its folder.

    If the folder or a picture cannot be written, the result says so before any planning.

    Args:
        request: input, options and outputs.
        checked: valid mission.
        folder: path of the plan folder; None if none is written.
        budget: limits of time and memory.
    """
    from missionc.output.export.formats import FORMATS
    from missionc.output.folder.overlap import overlapping
    from missionc.output.folder.write_folder import refuse
    from missionc.output.plot.figures import refuse_moments
    from missionc.output.plot.plot import missing

    absent = next(filter(None, (FORMATS[name].missing() for name in request.exports)), None)
    late = refuse_moments(request.figure, checked.mission) if checked.mission else None
    refused = (request.plot and missing()) or late or absent or overlapping(*_paths(request, checked, folder))
    refused = refused or (refuse(folder, request.force) if folder else None)
    if refused and checked.ok:
        return _refused(Compiled(checked, InvalidMission(), checked.findings, checked.seconds), refused)
    kept_run = KeptRun(request.checkpoint, request.resume)
    checkpoints = kept_run.checkpoints(budget.limits)
    if isinstance(checkpoints, Diagnostic):
        return _refused(Compiled(checked, InvalidMission(), checked.findings, checked.seconds), checkpoints)
    output = PlanFolder(folder, request.force)
    asked = replace(request.plan_request(budget), checkpoints=checkpoints, secure=output.write)
    compiled = driver.plan(checked, asked)
    answer = _answer(request, compiled, output)
    if kept_run.wrong:
        findings = (*answer.compiled.findings, kept_run.wrong)
        return CompileResult(replace(answer.compiled, findings=findings), Status.MISSION_ERRORS, answer.output)
    return answer


def _paths(request: CompileRequest, checked: Checked, folder: Path | None) -> tuple[list[WrittenPath], list[Path]]:
    """All output paths with their flags, and all input paths.

    A run may be saved to the file from which it is resumed, which then is not an input.
    """
    from missionc.output.folder.overlap import WrittenPath, within

    named = [("-o", folder), ("--plot", request.plot), ("--checkpoint", request.checkpoint)]
    outputs = [WrittenPath(flag, path, flag == "-o") for flag, path in named if path]
    again = request.resume and request.checkpoint and within(request.resume, request.checkpoint)
    resumed = [request.resume] if request.resume and not again else []
    return outputs, [*(Path(source.name) for source in checked.sources), *resumed]


@dataclass(slots=True)
class PlanFolder:
    """Plan folder of a compilation, written for the first verified plan and for each better one.

    Args:
        path: path, or None for no folder.
        force: if true, a folder from before the compilation may be replaced.
    """

    path: Path | None
    force: bool
    kept: Compiled | None = None
    """Last result that was written to the folder."""

    def write(self, compiled: Compiled) -> Diagnostic | None:
        """Write the files of a result, unless the folder already has them; return the error, if any."""
        from missionc.output.folder.file_names import MANIFEST
        from missionc.output.folder.write_folder import write_folder

        before = dict(self.kept.files) if self.kept else {}
        if self.path is None or not compiled.files or dict(compiled.files) == before:
            return None
        manifest = self.path / MANIFEST
        own = bool(before) and manifest.is_file() and manifest.read_bytes() == before[MANIFEST]
        wrong = write_folder(self.path, compiled.files, self.force or own)
        self.kept = self.kept if wrong else compiled
        if not wrong and isinstance(compiled.outcome, Verified):
            tell_kept()
        return wrong


def _answer(request: CompileRequest, compiled: Compiled, folder: PlanFolder) -> CompileResult:
    """Write the files of a compilation, and return its result.

    Args:
        request: input, options and outputs.
        compiled: compilation.
        folder: plan folder of the compilation.
    """
    match compiled.outcome:
        case InvalidMission():
            return CompileResult(compiled, Status.MISSION_ERRORS)
        case Unverified():
            return CompileResult(compiled, Status.NOT_VERIFIED)
        case NotFound():
            return _write(request, compiled, Status.UNDECIDED, folder)
        case Impossible(scope=Scope.MISSION):
            return _write(request, compiled, Status.NO_MOTION, folder)
        case Impossible():
            return _write(request, compiled, Status.IMPOSSIBLE if compiled.ruled_out else Status.UNDECIDED, folder)
        case Verified():
            status = Status.MISSION_ERRORS if has_errors(list(compiled.findings)) else Status.DONE
            return _write(request, compiled, status, folder)
        case _:
            assert_never(compiled.outcome)


def _write(request: CompileRequest, compiled: Compiled, status: Status, folder: PlanFolder) -> CompileResult:
    """Write the complete plan folder, then the requested picture; on failure nothing changes.

    Args:
        request: input, options and outputs.
        compiled: compilation.
        status: exit status if everything is written.
        folder: plan folder of the compilation.
    """
    wrong = folder.write(compiled)
    if wrong and folder.kept:
        finding = later_not_written(wrong)
        kept = replace(folder.kept, findings=(*folder.kept.findings, finding))
        return CompileResult(kept, Status.DONE, str(folder.path))
    if wrong:
        return _refused(compiled, wrong)
    if request.plot and isinstance(compiled.outcome, Verified):
        wrong = _draw(request, compiled, request.plot)
    if wrong:
        compiled, status = replace(compiled, findings=(*compiled.findings, wrong)), Status.MISSION_ERRORS
    return CompileResult(compiled, status, str(folder.path or "") if compiled.files else "")


def _draw(request: CompileRequest, compiled: Compiled, plot: Path) -> Diagnostic | None:
    """Write the requested picture of a plan; return the error, if any.

    Args:
        request: input, options and outputs.
        compiled: compilation with a plan.
        plot: path of the picture.
    """
    from missionc.compiler.graphs import picture_of
    from missionc.output.folder.write_folder import write_file

    try:
        picture = picture_of(compiled, request.figure, plot.suffix[1:], request.seed)
    except Exception as error:
        reraise_stop()
        return improvement_failed("drawing the plan", error)
    return picture if isinstance(picture, Diagnostic) else write_file(plot, picture)


def _refused(compiled: Compiled, finding: Diagnostic) -> CompileResult:
    """Result of a compilation whose output cannot be written, with that finding."""
    findings = (*compiled.findings, finding)
    return CompileResult(replace(compiled, outcome=InvalidMission(), findings=findings), Status.MISSION_ERRORS)


def _stage_lines(texts: list[tuple[str, str]]) -> list[str]:
    """Lines with the texts of stages, with headings if there are several."""
    if len(texts) == 1:
        return [texts[0][1].rstrip("\n")]
    return [line for stage, text in texts for line in (f"# {stage}", text.rstrip("\n"), "")]
