"""Diagnostic as a value: message, source locations, reasons and one fix; the renderers are separate.

Order of diagnostics in the output: the order of their source locations.
"""

from __future__ import annotations

from missionc.base.diagnostics.code import Code, Severity
from missionc.base.late_dataclass import Record
from missionc.base.notebook import printed, shown
from missionc.base.source import Span


class Label(Record):
    """Source location of a finding with a message about it; the message may be empty at the primary location."""

    span: Span
    message: str = ""


class Fix(Record):
    """Replacement text for a span of the source that repairs the finding."""

    span: Span
    replacement: str


class Diagnostic(Record):
    """Finding of the compiler: an error or a warning with its source locations.

    Args:
        message: one phrase with numbers and units as the user wrote them, without a full stop.
        primary: location of the finding; None only if the finding is not about a text (an unreadable file).
        labels: other locations that contribute to the finding.
        notes: reasons, one line each.
        help: one remedy, in the imperative.
        fix: text replacement that repairs the finding, if there is one.
        as_warning: report the finding as a warning, even if its code is an error.
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
        """Message, notes and help of the finding, one line each, without the source locations."""
        return "\n".join([self.message, *self.notes, *([f"help: {self.help}"] if self.help else [])])

    def __str__(self) -> str:
        from missionc.base.diagnostics.render import render_text  # rarely needed

        return render_text([self], False).removesuffix("\n")

    _repr_pretty_ = printed
    _repr_html_ = shown


def has_errors(findings: list[Diagnostic]) -> bool:
    """Return true if any of the findings is an error, which stops the compilation."""
    return any(finding.severity is Severity.ERROR for finding in findings)


def in_text_order(findings: list[Diagnostic]) -> list[Diagnostic]:
    """Findings sorted by source location, file by file in order of first appearance; findings without a location come
    first."""
    files: dict[int, int] = {}
    keyed = []
    for finding in findings:
        if finding.primary is None:
            keyed.append(((-1, 0), finding))
            continue
        span = finding.primary.span
        keyed.append(((files.setdefault(id(span.source), len(files)), span.start), finding))
    return [finding for _, finding in sorted(keyed, key=lambda pair: pair[0])]
