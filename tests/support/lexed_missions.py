"""All missions as the compiler reads them, for tests of highlighting: `python -m tests.support.lexed_missions`.

Prints JSON: for each text its tokens, comments too, each with what the parser took it for (a word that is not reserved
is a keyword in one place and a name in another) and where it is, in UTF-16 code units.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

from hypothesis import given, settings

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast, parse
from missionc.frontend.syntax.read_file import unread
from missionc.frontend.syntax.show_tree import show
from missionc.frontend.syntax.tokens import LABEL, NAME, NUMBER, TEXT, UNIT
from missionc.ir.language.operators import OPERATORS
from tests.support.golden_pages import blocks, file_name, is_fragment
from tests.support.random_trees import programs

ROOT = Path(__file__).resolve().parents[2]
CLASSES = {NAME: "name", LABEL: "label", NUMBER: "number", UNIT: "unit", TEXT: "string"}
DRAWN = 100
PUNCTUATION = frozenset("()[]{},:")


class Watching(parse.Machine):
    """Parser that records its tokens with their kinds."""

    took: list[tuple[str, Span]]

    def feed(self, kind: str, value: object, span: Span) -> bool:
        taken = super().feed(kind, value, span)
        if taken:
            self.took.append((kind, span))
        return taken


def lexed(name: str, text: str) -> list[dict[str, object]]:
    """Tokens of a text without errors, in order."""
    took: list[tuple[str, Span]] = []
    with patch.object(parse, "Machine", type("Watching", (Watching,), {"took": took})):
        _, findings = parse.parse(Source(name, text), Limits(), unread)
    assert not findings, (name, findings)
    spans = [(span.start, span.end, _class(kind, span.text)) for kind, span in took]
    gaps = zip([0, *(end for _, end, _ in spans)], [*(start for start, _, _ in spans), len(text)], strict=True)
    comments = [
        (match.start(), match.end(), "comment")
        for low, high in gaps
        for match in re.compile("#[^\n]*").finditer(text, low, high)
    ]
    return [
        {"class": kind, "start": _units(text[:start]), "end": _units(text[:end]), "text": text[start:end]}
        for start, end, kind in sorted(spans + comments)
    ]


def _class(kind: str, text: str) -> str:
    if text in PUNCTUATION:
        return "punctuation"
    return CLASSES.get(kind, "keyword" if text[0].isalpha() else "operator")


def _units(text: str) -> int:
    return len(text.encode("utf-16-le")) // 2


def drawn(count: int) -> list[str]:
    """Random programs whose names coincide with all words that may be names."""
    found: list[str] = []

    @settings(max_examples=count, derandomize=True, database=None, deadline=None)
    @given(programs)
    def collect(program: ast.Program) -> None:
        found.append(show(program))

    collect()
    return found


def texts() -> Iterator[tuple[str, str]]:
    """Missions of the repository and of its pages, special cases, each operator, and random ones."""
    for file in sorted((ROOT / "missions").rglob("*.mission")):
        yield str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")
    for file in sorted((ROOT / "editors" / "vscode" / "test").glob("*.mission")):
        yield str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")
    for page in sorted((ROOT / "docs").glob("*.md")):
        for at, block in enumerate(blocks(page.read_text(encoding="utf-8"))):
            if block.info.split()[:1] == ["mission"] and "wrong" not in block.info:
                name = "fragment" if is_fragment(block) else file_name(block)
                yield f"docs/{page.name}:{at}:{name}", block.body
    for operator in OPERATORS:
        yield f"operator {operator.name}", f"let example = {operator.example}\n"
    yield "a layer of a drawing", 'obstacles from "hall.dxf" layer "WALLS"\n'
    yield "an origin on the globe", 'regions from "site.geojson" origin (8.55 deg, 47.37 deg)\n'
    for number, text in enumerate(drawn(DRAWN)):
        yield f"drawn {number}", text


if __name__ == "__main__":
    json.dump([{"name": name, "text": text, "tokens": lexed(name, text)} for name, text in texts()], sys.stdout)
