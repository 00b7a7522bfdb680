"""Open texts for the tests of the language server, with a position marked by `|`."""

from __future__ import annotations

from lsprotocol import types

from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.ir import Mission
from missionc.tools.language_server.open_text import OpenText

NAME = "/somewhere/typed.mission"
URI = f"file://{NAME}"


def opened(
    text: str,
    encoding: str = types.PositionEncodingKind.Utf16,
    before: Mission | None = None,
    checked: bool = True,
    name: str = NAME,
    version: int = 1,
) -> OpenText:
    """Text as in the server, checked by default."""
    found = OpenText(f"file://{name}", version, Source(name, text), encoding, before)
    if checked:
        found.found = check(found.source)
    return found


def marked(text: str, **options: object) -> tuple[OpenText, types.Position]:
    """Text without its single `|`, and the position of that."""
    offset = text.index("|")
    without = opened(text[:offset] + text[offset + 1 :], **options)  # type: ignore[arg-type]
    return without, without.places.position(offset)


def edited(text: OpenText, edits: list[types.TextEdit]) -> str:
    """Text after some edits, as in an editor."""
    written = text.source.text
    spans = [
        (text.places.offset(edit.range.start), text.places.offset(edit.range.end), edit.new_text) for edit in edits
    ]
    for start, end, new in sorted(spans, reverse=True):
        written = written[:start] + new + written[end:]
    return written
