"""Document links: each file that a text names leads to that file."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path, PurePosixPath

from lsprotocol import types
from pygls.uris import from_fs_path

from missionc.lsp.open_text import OpenText
from missionc.syntax.read_file import strange
from missionc.syntax.tokens import TEXT

BEFORE = frozenset({"include", "from", "="})
"""What stands before the name of a file: ``include "…"``, ``from "…"``, ``roadmap = "…"``."""


def links(text: OpenText) -> list[types.DocumentLink]:
    """The files that the text names by a relative path, whether they are there or not; none of a text on no disk."""
    if not text.uri.startswith("file:"):
        return []
    folder = Path(text.source.name).absolute().parent
    found = []
    for before, token in pairwise(text.tokens):
        written = token.text[1:-1]
        if token.kind != TEXT or before.text not in BEFORE or strange(written):
            continue
        span = token.span
        inner = text.places.between(span.start + 1, span.end - 1)
        target = from_fs_path(str(folder / PurePosixPath(written)))
        found.append(types.DocumentLink(inner, target, f"Open {written}"))
    return found
