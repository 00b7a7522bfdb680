"""The text cut into passages, each of which can be read without the others; and what unchanged ones said before.

A passage begins where a line does, with a word that declares something: there
every declaration before it ends, whatever is wrong with it, and so does what a
character means by those before it. Most hold one declaration.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from missionc.source import Source, Span
from missionc.syntax import ast
from missionc.syntax.tokens import DECLARATIONS

Node = TypeVar("Node")

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

    Of one file and one set of limits; passages with findings or an ``include`` are not kept. Threads may
    share one: a reading looks things up in what the one before left, and leaves its own as a whole.
    """

    declared: dict[str, tuple[int, tuple[ast.Declaration, ...]]] = field(default_factory=dict)

    def of(self, source: Source, begin: int, end: int) -> tuple[ast.Declaration, ...] | None:
        """The declarations of a passage where they stand now; None where it has to be read."""
        known = self.declared.get(source.text[begin:end])
        if known is None:
            return None
        before, declarations = known
        return tuple([moved(declaration, source, begin - before) for declaration in declarations])

    def keep(self, source: Source, read: Sequence[tuple[int, int, tuple[ast.Declaration, ...]]]) -> None:
        self.declared = {source.text[begin:end]: (begin, declarations) for begin, end, declarations in read}


def moved(node: Node, source: Source, by: int) -> Node:
    """A tree as it would have been read in another text, ``by`` characters further on."""
    values: list[Any] = []
    for name in node.__match_args__:  # type: ignore[attr-defined]
        value = getattr(node, name)
        if isinstance(value, Span):
            value = Span(source, value.start + by, value.end + by)
        elif isinstance(value, tuple):
            parts = []
            for part in value:  # a comprehension would take a stack frame more for each level
                parts.append(moved(part, source, by))  # noqa: PERF401
            value = tuple(parts)
        elif hasattr(value, "__match_args__"):
            value = moved(value, source, by)
        values.append(value)
    return type(node)(*values)
