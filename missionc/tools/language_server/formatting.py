"""Formatting request: edits that give changed lines the standard layout."""

from __future__ import annotations

from difflib import SequenceMatcher

from lsprotocol import types

from missionc.base.source import Source
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.tools.language_server.open_text import LIMITS, OpenText


def formatting(text: OpenText) -> list[types.TextEdit]:
    """Edits that give a text the standard layout, with unchanged line ends; empty for a text with syntax errors."""
    written = text.source.text
    mark = written[:1] if written.startswith("\ufeff") else ""
    source = Source(text.source.name, written[len(mark) :])
    program, _ = parse(source, LIMITS, unread)
    if program is None:
        return []
    wanted = mark + format_mission(source, program, LIMITS)
    if "\r\n" in written:
        wanted = wanted.replace("\n", "\r\n")
    before, after = written.splitlines(keepends=True), wanted.splitlines(keepends=True)
    starts = [0]
    for line in before:
        starts.append(starts[-1] + len(line))
    return [
        types.TextEdit(text.places.between(starts[first], starts[last]), "".join(after[low:high]))
        for word, first, last, low, high in SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
        if word != "equal"
    ]
