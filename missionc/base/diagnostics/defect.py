"""Defects of the compiler as findings: an unexpected error, with the code line that raised it.

says MC410 MC411 MC412 MC413 MC602 MC603 MC613 MC901
"""

from __future__ import annotations

from missionc.base.diagnostics.code import IMPROVEMENT_FAILED, INTERNAL, OUT_OF_MEMORY, OUT_OF_TIME
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.extensions import ExtensionError, failure
from missionc.base.memory import exhausted
from missionc.base.source import Span
from missionc.base.supervision import Cause, Ended

KEPT = "the result before this step is complete and unchanged"
TRACEBACK = "set MISSIONC_TRACEBACK=1 to see the traceback"


def defect(error: Exception) -> Diagnostic:
    """Finding for an unexpected error that ends a command."""
    if isinstance(error, ExtensionError):
        return extension_error(error)
    return Diagnostic(
        INTERNAL,
        f"internal error: {failure(error)}",
        None,
        notes=(*((str(error)[:200],) if str(error) else ()), TRACEBACK),
        help="report this bug with the mission, the command and `missionc --version`",
    )


def extension_error(error: ExtensionError, span: Span | None = None) -> Diagnostic:
    """Finding for an extension that cannot be used.

    Args:
        span: text of the mission that uses the extension; None if no text does.
    """
    return Diagnostic(error.code, error.message, Label(span) if span else None, notes=error.notes, help=error.help)


def improvement_failed(step: str, error: Exception) -> Diagnostic:
    """Finding for an error in a step after the command had its result (a verified plan or a refusal).

    Args:
        step: name of the step, as the subject of a sentence.
    """
    memory = exhausted(error)
    ours = f"internal error: {failure(error)}"
    why = error.message if isinstance(error, ExtensionError) else ours
    why = "out of memory" if memory else why
    return Diagnostic(
        IMPROVEMENT_FAILED,
        f"{step} failed: {why}",
        None,
        notes=(KEPT,),
        help="raise the limit with `--memory-limit`"
        if memory
        else "report this bug with the mission, the command and `missionc --version`",
    )


def cut_off(ended: Ended) -> Diagnostic:
    """Finding for a worker process that its parent or the operating system ended."""
    code, why, help_ = {
        Cause.TIME: (OUT_OF_TIME, "the time limit was reached in", "raise the limit with `--time-limit`"),
        Cause.MEMORY: (OUT_OF_MEMORY, "the memory limit was reached in", "raise the limit with `--memory-limit`"),
        Cause.CRASH: (INTERNAL, f"internal error: signal {ended.status} in", "report this bug with the mission"),
    }[ended.cause or Cause.CRASH]
    why += " a library call without interruption points"
    if ended.kept:
        return Diagnostic(IMPROVEMENT_FAILED, f"improving the plan failed: {why}", None, notes=(KEPT,), help=help_)
    return Diagnostic(code, why if code is INTERNAL else f"undecided: {why}", None, help=help_)


def later_not_written(wrong: Diagnostic) -> Diagnostic:
    """Finding for a better plan that could not replace the verified plan in the plan folder.

    Args:
        wrong: finding about the failed write.
    """
    return Diagnostic(
        IMPROVEMENT_FAILED,
        f"a better plan was found but not written: {wrong.message}",
        None,
        notes=(*wrong.notes, "the folder contains the previous verified plan"),
        help="name another folder with `-o`",
    )
