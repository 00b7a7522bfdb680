"""Defects of the compiler as findings: an error that no stage foresaw, and where it happened.

says MC613 MC901
"""

from __future__ import annotations

from pathlib import Path

from missionc.diagnostics.code import IMPROVEMENT_FAILED, INTERNAL
from missionc.diagnostics.model import Diagnostic

MORE = "MISSIONC_TRACEBACK=1 shows more"


def defect(error: Exception) -> Diagnostic:
    """Report an error that ends a command."""
    return Diagnostic(
        INTERNAL,
        f"a defect of the compiler: {_named(error)}",
        None,
        notes=(str(error)[:200],) if str(error) else (),
        help=f"report it with the mission, the command and `missionc --version`; {MORE}",
    )


def improvement_failed(step: str, error: Exception) -> Diagnostic:
    """Report an error in a step that follows the answer of a command, a verified plan or a refusal.

    Args:
        step: the subject of a sentence.
    """
    memory = isinstance(error, MemoryError)
    why = "memory ran out" if memory else f"a defect of the compiler: {_named(error)}"
    return Diagnostic(
        IMPROVEMENT_FAILED,
        f"{step} failed: {why}",
        None,
        notes=("the result was complete before this step, and is unchanged",),
        help="allow more with `--memory-limit`"
        if memory
        else "use the result, and report the defect with the mission, the command and `missionc --version`",
    )


def _named(error: Exception) -> str:
    """The kind of an error and the line that raised it: ``ZeroDivisionError at check_world.py:42``."""
    place = error.__traceback__
    while place and place.tb_next:
        place = place.tb_next
    where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}" if place else "nowhere"
    return f"{type(error).__name__} at {where}"
