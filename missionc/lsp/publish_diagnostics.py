"""Published diagnostics: findings in the protocol's form.

What is wrong in a file that this one names is shown where it does, with the place itself beside it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from posixpath import basename

from lsprotocol import types

from missionc.base.resources import folder
from missionc.base.source import Span
from missionc.diagnostics.code import UNUSED_NAME, Severity
from missionc.diagnostics.model import Diagnostic
from missionc.lsp.open_text import OpenText

SEVERITIES = {Severity.ERROR: types.DiagnosticSeverity.Error, Severity.WARNING: types.DiagnosticSeverity.Warning}
_INCLUDE = re.compile(r'^[ \t]*include\s+"[^"\n]*"', re.MULTILINE)


def diagnostics(text: OpenText, findings: Sequence[Diagnostic]) -> list[types.Diagnostic]:
    return [_diagnostic(text, finding) for finding in findings]


def _diagnostic(text: OpenText, finding: Diagnostic) -> types.Diagnostic:
    span = finding.primary.span if finding.primary else Span(text.source, 0, 0)
    labels = [label for label in finding.labels if label.message]
    elsewhere = span.source.name != text.source.name
    related = [(label.span, label.message) for label in labels]
    if elsewhere:
        related.insert(0, (span, finding.message))
    elif finding.primary and finding.primary.message:
        related.insert(0, (span, finding.primary.message))
    return types.Diagnostic(
        range=text.places.range(_named(text, span) if elsewhere else span),
        message=finding.words,
        severity=SEVERITIES[finding.severity],
        code=finding.code.name,
        code_description=types.CodeDescription((folder("docs/errors") / f"{finding.code.name}.md").as_uri()),
        source="missionc",
        related_information=[_related(text, *place) for place in related] or None,
        tags=[types.DiagnosticTag.Unnecessary] if finding.code is UNUSED_NAME else None,
    )


def _related(text: OpenText, span: Span, message: str) -> types.DiagnosticRelatedInformation:
    places = text.places_in(span.source)
    return types.DiagnosticRelatedInformation(types.Location(text.uri_of(span.source), places.range(span)), message)


def _named(text: OpenText, place: Span) -> Span:
    """Where this text names the file of a place, or includes another, the first time."""
    named = re.search(rf'"(?:[^"\n]*/)?{re.escape(basename(place.source.name))}"', text.source.text)
    match = named or _INCLUDE.search(text.source.text)
    return Span(text.source, *match.span()) if match else Span(text.source, 0, 0)
