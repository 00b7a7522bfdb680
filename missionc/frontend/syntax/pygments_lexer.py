"""Pygments lexer of missions for a ``mission`` fence in Markdown, ``pygmentize -l mission`` or a notebook.

The tokens are the compiler's own (``tokens``), so there is no second table of words. Pygments finds the class by the
entry point in ``pyproject.toml``; no module of missionc imports this one, and it needs Pygments.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

from pygments.lexer import Lexer
from pygments.token import Comment, Error, Keyword, Name, Number, Operator, Punctuation, String, Whitespace

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax.tokens import (
    LABEL,
    NAME,
    NUMBER,
    SEVERAL,
    SPELLINGS,
    STATES,
    STRAY,
    TEXT,
    UNIT,
    Token,
    tokenise,
)

if TYPE_CHECKING:
    from pygments.token import _TokenType as TokenType

COLOURS: dict[str, TokenType] = {
    "a declaration": Keyword.Declaration,
    "a shape": Name.Builtin,
    "an operator": Operator.Word,
    "a quantifier": Operator.Word,
    "a formula": Keyword.Constant,
    "a measure": Name.Builtin,
    "the mission's last step": Keyword.Constant,
    "a preposition": Keyword,
    "a part of `time`": Keyword,
    "a motion": Keyword,
    "a part of a team": Keyword,
    "a yaw mode": Keyword,
    "a kind of graph": Name.Builtin,
    "a part of a formation": Keyword,
    "a part of `prefer`": Keyword,
    "a part of `flight`": Keyword,
    "a part of `tolerate`": Keyword,
    "a part of `from`": Keyword,
}
"""Pygments token type for each kind of word, by the kind's description in the table of words."""

OTHERS: dict[str, TokenType] = {
    NUMBER: Number,
    UNIT: Keyword.Type,
    TEXT: String,
    LABEL: Name.Label,
    SEVERAL: Keyword.Declaration,
    STRAY: Error,
}
_GAP = re.compile(r"(#[^\n]*)|\s+|.", re.DOTALL)


class MissionLexer(Lexer):
    """Pygments lexer of the mission language."""

    name = "Mission"
    aliases: ClassVar[list[str]] = ["mission"]
    filenames: ClassVar[list[str]] = ["*.mission"]

    def get_tokens_unprocessed(self, text: str) -> Iterator[tuple[int, TokenType, str]]:
        """Yield the parts of a text with their offsets and token types; every character occurs once and in order."""
        tokens, _ = tokenise(Span(Source("", text), 0, len(text)), Limits())
        at, before = 0, None
        for token in tokens:
            yield from _between(text, at, token.span.start)
            at = token.span.end
            if token.text:
                yield token.span.start, _colour(token, before), token.text
            before = token


def _between(text: str, start: int, end: int) -> Iterator[tuple[int, TokenType, str]]:
    """Yield white space and comments between two offsets, which are not tokens for the parser."""
    for match in _GAP.finditer(text, start, end):
        yield match.start(), Comment.Single if match[1] else Whitespace, match[0]


def _colour(token: Token, before: Token | None) -> TokenType:
    if token.kind in OTHERS:
        return OTHERS[token.kind]
    if token.word:
        if not token.text[0].isalpha():
            return Operator
        return COLOURS[SPELLINGS[token.word].says]
    if token.kind == NAME:
        if before is not None and before.declares:
            return Name.Class
        return Name.Builtin if token.text in STATES else Name
    return Operator if token.text in ("<=", ">=", "<", ">", "=", "+", "-", "*", "/", "..") else Punctuation
