"""Passages of a text: where it can be cut so that each part is read without the others.

A passage begins where a line does, with a word that declares something: there
every declaration before it ends, whatever is wrong with it, and so does what a
character means by those before it. Most hold one declaration.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from missionc.base.source import Source, Span
from missionc.frontend.syntax.tokens import BEFORE_FILE, DECLARATIONS, PLURALS

# After `require` a word before a colon is a label, whichever it is.
_ONE, _SEVERAL = "|".join(sorted(DECLARATIONS - PLURALS)), "|".join(sorted(PLURALS))
_BEGINS = re.compile(rf"^[ \t]*(?:(?:{_ONE})\b(?!\s*:)|(?:{_SEVERAL})\b{BEFORE_FILE})", re.MULTILINE)


def passages(source: Source) -> Iterator[Span]:
    """The passages of a source, in order; together they are the whole text."""
    begin = 0
    for match in _BEGINS.finditer(source.text):
        if match.start() > begin:
            yield Span(source, begin, match.start())
        begin = match.start()
    yield Span(source, begin, len(source.text))
