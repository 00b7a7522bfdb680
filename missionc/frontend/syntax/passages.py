"""Passages of a text: parts that can be parsed independently of each other.

A passage begins at the start of a line with a word that declares something: there every earlier declaration ends, even
with errors, and no character depends on earlier ones. Most passages contain one declaration.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from missionc.base.source import Source, Span
from missionc.frontend.syntax.tokens import BEFORE_FILE, DECLARATIONS, PLURALS

# After `require`, any word before a colon is a label.
_ONE, _SEVERAL = "|".join(sorted(DECLARATIONS - PLURALS)), "|".join(sorted(PLURALS))
_BEGINS = re.compile(rf"^[ \t]*(?:(?:{_ONE})\b(?!\s*:)|(?:{_SEVERAL})\b{BEFORE_FILE})", re.MULTILINE)


def passages(source: Source) -> Iterator[Span]:
    """Yield the passages of a source in order; together they are the complete text."""
    begin = 0
    for match in _BEGINS.finditer(source.text):
        if match.start() > begin:
            yield Span(source, begin, match.start())
        begin = match.start()
    yield Span(source, begin, len(source.text))
