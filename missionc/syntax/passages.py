"""Incremental reading: the text cut into passages, each of which can be read without the others.

A passage begins where a line does, with a word that declares something: there
every declaration before it ends, whatever is wrong with it, and so does what a
character means by those before it. Most hold one declaration.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Passage, Source
from missionc.syntax import ast
from missionc.syntax.tokens import DECLARATIONS

# After `require` a word before a colon is a label, whichever it is.
_BEGINS = re.compile(rf"^[ \t]*(?:{'|'.join(sorted(DECLARATIONS))})\b(?!\s*:)", re.MULTILINE)


def passages(text: str) -> Iterator[tuple[int, int]]:
    """Where each passage begins and ends; together they are the whole text."""
    begin = 0
    for match in _BEGINS.finditer(text):
        if match.start() > begin:
            yield begin, match.start()
        begin = match.start()
    yield begin, len(text)


@dataclass(slots=True)
class Kept:
    """What each passage of a text declared when it was read last, so that only those that changed are read again.

    Of one file and one set of limits; passages with findings or an ``include`` are not kept. The declarations
    are the same objects each time, and their spans move along: what was made of an older text speaks of the new one.
    """

    declared: dict[str, list[tuple[Passage, tuple[ast.Declaration, ...]]]] = field(default_factory=dict)
    """By their text; there may be several of the same."""

    def forgotten(self) -> Kept:
        """All of it, and nothing stays here: a reading takes from it what it finds again."""
        before, self.declared = Kept(self.declared), {}
        return before

    def found(self, source: Source, begin: int, end: int) -> tuple[Passage, tuple[ast.Declaration, ...]] | None:
        """A passage and its declarations, where they stand now; None where it has to be read."""
        again = self.declared.get(source.text[begin:end])
        if not again:
            return None
        passage, declarations = again.pop(0)
        passage.stands = source, begin
        return passage, declarations

    def lost(self) -> None:
        """What was not found again is in no text any more; whatever still speaks of it holds on to its words alone."""
        for text, passages_of_it in self.declared.items():
            for passage, _ in passages_of_it:
                passage.stands = Source(passage.source.name, text), 0

    def keep(self, passage: Passage, declarations: tuple[ast.Declaration, ...]) -> None:
        text = passage.source.text[passage.begin : passage.begin + passage.size]
        self.declared.setdefault(text, []).append((passage, declarations))
