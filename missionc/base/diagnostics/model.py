"""A diagnostic as a value: what is wrong, where, why, and one fix. Rendering is elsewhere."""

from __future__ import annotations

from missionc.base.diagnostics.code import Code, Severity
from missionc.base.late_dataclass import dataclass
from missionc.base.notebook import printed, shown
from missionc.base.source import Span


@dataclass(frozen=True, slots=True)
class Label:
    """A place, and what to say beside it (may be empty at the primary place)."""

    span: Span
    message: str = ""


@dataclass(frozen=True, slots=True)
class Fix:
    """Text that may replace a span to mend the finding."""

    span: Span
    replacement: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding.

    ``message`` is one phrase in the user's numbers and units, without a final
    stop; ``labels`` are the other places that make it wrong; ``help`` is one
    way out in the imperative. ``primary`` is absent only where the finding is
    about no text (an unreadable file, say). ``as_warning``: a warning here, whatever the severity of its code.
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
        """The message, why, and a way out, for who shows the place otherwise; a line each."""
        return "\n".join([self.message, *self.notes, *([f"help: {self.help}"] if self.help else [])])

    def __str__(self) -> str:
        from missionc.base.diagnostics.render import render_text  # few say a finding by itself

        return render_text([self], False).removesuffix("\n")

    _repr_pretty_ = printed
    _repr_html_ = shown


def has_errors(findings: list[Diagnostic]) -> bool:
    """Whether any finding stops the compilation."""
    return any(finding.severity is Severity.ERROR for finding in findings)
