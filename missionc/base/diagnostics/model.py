"""A diagnostic as a value: the error, its place, the reason, and one fix. Rendering is elsewhere."""

from __future__ import annotations

from missionc.base.diagnostics.code import Code, Severity
from missionc.base.late_dataclass import Record
from missionc.base.notebook import printed, shown
from missionc.base.source import Span


class Label(Record):
    """Place with the text next to it (may be empty at the primary place)."""

    span: Span
    message: str = ""


class Fix(Record):
    """Text that may replace a span to fix the finding."""

    span: Span
    replacement: str


class Diagnostic(Record):
    """Single finding.

    ``message`` is one phrase in the user's numbers and units, without a final stop; ``labels`` are the other places
    that cause it; ``help`` is one remedy in the imperative. ``primary`` is None only if the finding is not about a text
    (for example, an unreadable file). ``as_warning``: a warning here, whatever the severity of its code.
    """

    code: Code
    message: str
    primary: Label | None
    labels: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()
    help: str = ""
    fix: Fix | None = None
    as_warning: bool = False

    @property
    def severity(self) -> Severity:
        return Severity.WARNING if self.as_warning else self.code.severity

    @property
    def words(self) -> str:
        """Message, reason and remedy, one line each, for output that shows the place separately."""
        return "\n".join([self.message, *self.notes, *([f"help: {self.help}"] if self.help else [])])

    def __str__(self) -> str:
        from missionc.base.diagnostics.render import render_text  # rarely needed

        return render_text([self], False).removesuffix("\n")

    _repr_pretty_ = printed
    _repr_html_ = shown


def has_errors(findings: list[Diagnostic]) -> bool:
    """Return whether any finding stops the compilation."""
    return any(finding.severity is Severity.ERROR for finding in findings)
