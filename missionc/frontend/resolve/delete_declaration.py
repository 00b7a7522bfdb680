"""Fix that deletes a declaration from the text."""

from __future__ import annotations

import re

from missionc.base.diagnostics.model import Fix
from missionc.base.source import Span

_REST_OF_LINE = re.compile(r"[ \t]*\r?\n")


def deleted(span: Span) -> Fix:
    """Fix that deletes a declaration, with its line if nothing else is on the line."""
    text, start, end = span.source.text, span.start, span.end
    line = text.rfind("\n", 0, start) + 1
    rest = _REST_OF_LINE.match(text, end)
    if rest and not text[line:start].strip():
        start, end = line, rest.end()
    return Fix(Span(span.source, start, end), "")
