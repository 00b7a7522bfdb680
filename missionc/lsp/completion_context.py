"""Completion context: the tokens before the cursor in its declaration, and those that may follow.

The parser's own table says so. Words before the place that fit nowhere are passed over, so that
a declaration that is wrong somewhere still knows where it is.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.syntax import parse_table
from missionc.syntax.machine import Machine
from missionc.syntax.parse import feed
from missionc.syntax.parse_table import END
from missionc.syntax.passages import passages
from missionc.syntax.tokens import Token, tokenise

_WORD = re.compile(r"[^\W\d]\w*\Z")
_IN_COMMENT = re.compile(r'(?:[^"#\n]|"[^"\n]*")*(?:#|"[^"\n]*\Z)')
_OPENING, _CLOSING = frozenset("([{"), frozenset(")]}")


@dataclass(frozen=True, slots=True)
class Spot:
    """``start`` is where the word begins that is being written, at the place itself if there is none yet.

    ``taken`` are the words of the declaration before it, ``opened`` those of them that are brackets still
    open, ``expected`` the kinds of word that may follow; ``declares``: a declaration may begin here.
    """

    start: int
    taken: tuple[Token, ...]
    opened: tuple[int, ...]
    expected: frozenset[str]
    declares: bool

    @property
    def before(self) -> Token:
        return self.taken[-1]

    @property
    def bracket(self) -> str:
        """The innermost open bracket, or nothing."""
        return self.taken[self.opened[-1]].kind if self.opened else ""

    @property
    def asks_heading(self) -> bool:
        """Whether it is within the words that ask for a heading: after the last `of` or `within` there is no other."""
        words = [token.kind for token in self.taken if token.kind in ("heading", "within", "of")]
        return words[-3:] == ["heading", "within", "of"] and self.taken[0].word != "formation"

    def opener(self, back: int = 1) -> Token | None:
        """The word so far before the innermost open bracket."""
        at = self.opened[-1] - back if self.opened else -1
        return self.taken[at] if at >= 0 else None


def spot(source: Source, offset: int, limits: Limits) -> Spot | None:
    """None in comments and quotes, and in a text too large to be read."""
    text = source.text
    if len(text) > limits.file_bytes:
        return None
    line = text.rfind("\n", 0, offset) + 1
    if _IN_COMMENT.match(text[line:offset]):
        return None
    word = _WORD.search(text, line, offset)
    start = word.start() if word else offset
    begin = next(each.start for each in passages(source) if start < each.end or each.end == len(text))
    tokens, _ = tokenise(Span(source, begin, start), limits)
    return _after(tokens[:-1], start, not text[line:start].strip())


def _after(tokens: list[Token], start: int, starts_line: bool) -> Spot:
    machine = _machine()
    taken: list[Token] = []
    opened: list[int] = []
    for token in tokens:
        if token.declares and taken:
            machine, taken, opened = _machine(), [], []
        if not feed(machine, token):
            if not (taken and token.starts_line and machine.takes(END)):
                continue
            machine, taken, opened = _machine(), [], []
            if not feed(machine, token):
                continue
        if token.kind in _OPENING:
            opened.append(len(taken))
        elif token.kind in _CLOSING and opened:
            opened.pop()
        taken.append(token)
    declares = not taken or (starts_line and machine.takes(END))
    return Spot(start, tuple(taken), tuple(opened), machine.expected(), declares)


def _machine() -> Machine:
    """One that only knows what may come next, and makes nothing of it."""
    return Machine(parse_table.load(), defaultdict(_nothing), frozenset(), 0)


def _nothing() -> Callable[..., object]:
    return lambda span, *parts: None
