"""Checkpoints of a run: what identifies it, and the budget of a run that is kept or resumed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from missionc.backends.api import Budget, Snapshot, UnusableSnapshot
from missionc.backends.options import Options
from missionc.base.diagnostics.code import CHECKPOINT_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.compiler.front_end import Checked
from missionc.compiler.provenance import given, inputs
from missionc.frontend.syntax.read_file import read_bytes


@dataclass(frozen=True, slots=True)
class Checkpoints:
    """Args:
    keep: is given, as a run goes on, the bytes of a checkpoint.
    resume: those of the run to take up again.
    name: how messages call it.
    """

    keep: Callable[[bytes], object] | None = None
    resume: bytes | None = None
    name: str = "the checkpoint"

    @property
    def asked(self) -> bool:
        return self.keep is not None or self.resume is not None


@dataclass(slots=True)
class KeptRun:
    """The file in which a run is kept, and that of the run it takes up again."""

    checkpoint: Path | None
    resume: Path | None
    wrong: Diagnostic | None = None
    """What went wrong with keeping it; nothing more is written then."""

    def checkpoints(self, limits: Limits) -> Checkpoints | Diagnostic:
        """What the driver is to know; or what stands in the way, before anything is planned."""
        from missionc.output.folder.write_file import refuse_file

        content: bytes | Diagnostic | None = None
        if self.checkpoint is not None and (refused := refuse_file(self.checkpoint)):
            return refused
        if self.resume is not None:
            content = read_bytes(self.resume, str(self.resume), limits.checkpoint_bytes, CHECKPOINT_UNREADABLE)
        if isinstance(content, Diagnostic):
            return content
        return Checkpoints(None if self.checkpoint is None else self.write, content, str(self.resume))

    def write(self, content: bytes) -> None:
        """As a whole, so that whoever is killed leaves the one before."""
        from missionc.output.folder.write_file import write_file

        if self.checkpoint is not None and self.wrong is None:
            self.wrong = write_file(self.checkpoint, content)


def with_checkpoints(
    checked: Checked, options: Options, budget: Budget, checkpoints: Checkpoints
) -> Budget | Diagnostic:
    """The budget, with what is kept of the run and what it goes on from; or why it cannot go on from that."""
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
    """What to say of a checkpoint that is well formed and holds no run."""
    from missionc.compiler.checkpoint_file import unreadable

    return unreadable(name, str(wrong))


def _identity(checked: Checked, options: Options, budget: Budget) -> dict[str, str]:
    """All that a plan follows from, but for the time there is."""
    from missionc.output.folder.manifest import sha256, versions

    files = "".join(f"{name} {sha256(content)}\n" for name, content in inputs(checked))
    backend = " ".join(checked.choice.engines) if checked.choice else ""
    named = {name: str(value) for name, value in given(checked, options)}
    version = {f"version of {name}": number for name, number in versions().items()}
    return {"mission": sha256(files.encode()), "backend": backend, "seed": str(budget.seed), **named, **version}
