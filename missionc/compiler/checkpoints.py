"""Checkpoints of a run: the identity of the run, and the budget for saving or resuming it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from missionc.backends.api import Budget, Snapshot, UnusableSnapshot
from missionc.backends.options import Options
from missionc.base.diagnostics.code import CHECKPOINT_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.compiler.front_end import Checked
from missionc.compiler.provenance import given, inputs
from missionc.frontend.syntax.read_file import read_bytes


class Checkpoints(Record):
    """Checkpoint options of a run: where to save checkpoints, and the checkpoint to resume.

    Args:
        keep: receives the bytes of checkpoints during a run.
        resume: bytes of the run to resume.
        name: its name in messages.
    """

    keep: Callable[[bytes], object] | None = None
    resume: bytes | None = None
    name: str = "the checkpoint"

    @property
    def asked(self) -> bool:
        return self.keep is not None or self.resume is not None


@dataclass(slots=True)
class KeptRun:
    """Checkpoint file to write during a run, and checkpoint file to resume."""

    checkpoint: Path | None
    resume: Path | None
    wrong: Diagnostic | None = None
    """Error of the last attempt to save; afterwards no checkpoint is written."""

    def checkpoints(self, limits: Limits) -> Checkpoints | Diagnostic:
        """Checkpoint options for the driver, or a diagnostic if a file cannot be read or written."""
        from missionc.output.folder.write_folder import refuse_file

        content: bytes | Diagnostic | None = None
        if self.checkpoint is not None and (refused := refuse_file(self.checkpoint)):
            return refused
        if self.resume is not None:
            content = read_bytes(self.resume, str(self.resume), limits.checkpoint_bytes, CHECKPOINT_UNREADABLE)
        if isinstance(content, Diagnostic):
            return content
        return Checkpoints(None if self.checkpoint is None else self.write, content, str(self.resume))

    def write(self, content: bytes) -> None:
        """Write the checkpoint file atomically, so that an interruption leaves the previous one."""
        from missionc.output.folder.write_folder import write_file

        if self.checkpoint is not None and self.wrong is None:
            self.wrong = write_file(self.checkpoint, content)


def with_checkpoints(
    checked: Checked, options: Options, budget: Budget, checkpoints: Checkpoints
) -> Budget | Diagnostic:
    """Budget with the callbacks that save and resume a run, or the reason why the run cannot be resumed."""
    if not checkpoints.asked:
        return budget
    from missionc.compiler.checkpoint_file import from_bytes, to_bytes

    run = _identity(checked, options, budget)
    keep, resume = checkpoints.keep, checkpoints.resume
    snapshot = None if resume is None else from_bytes(resume, checkpoints.name, run)
    if isinstance(snapshot, Diagnostic):
        return snapshot
    if keep is None:
        return replace(budget, resume=snapshot)

    def put_aside(snapshot: Snapshot) -> None:
        keep(to_bytes(snapshot, run))

    return replace(budget, on_snapshot=put_aside, resume=snapshot)


def unusable(name: str, wrong: UnusableSnapshot) -> Diagnostic:
    """Diagnostic for a well-formed checkpoint that contains no valid run."""
    from missionc.compiler.checkpoint_file import unreadable

    return unreadable(name, str(wrong))


def _identity(checked: Checked, options: Options, budget: Budget) -> dict[str, str]:
    """All inputs that determine a plan, by name; the time limit is not included."""
    from missionc.output.folder.manifest import sha256, versions

    files = "".join(f"{name} {sha256(content)}\n" for name, content in inputs(checked))
    backend = " ".join(checked.choice.engines) if checked.choice else ""
    named = {name: str(value) for name, value in given(checked, options)}
    version = {f"version of {name}": number for name, number in versions().items()}
    return {"mission": sha256(files.encode()), "backend": backend, "seed": str(budget.seed), **named, **version}
