"""Folding ranges: blocks in brackets, longer declarations, runs of comments, and runs of one kind of declaration."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from lsprotocol import types

from missionc.frontend.syntax.tokens import Token
from missionc.tools.language_server.open_text import OpenText

_CLOSES = {"}": "{", ")": "(", "]": "["}


def folds(text: OpenText) -> list[types.FoldingRange]:
    """Folding ranges of a text, at most one for each first line; a block has priority over its declaration."""
    found = [*_blocks(text), *_declarations(text), *_comments(text)]
    by_line: dict[int, types.FoldingRange] = {}
    for fold in found:
        by_line.setdefault(fold.start_line, fold)
    return sorted(by_line.values(), key=lambda fold: fold.start_line)


def _blocks(text: OpenText) -> Iterator[types.FoldingRange]:
    """Yield the ranges between brackets; the line of a closing bracket that begins the line stays visible."""
    open_: list[Token] = []
    for token in text.tokens:
        if _begins(token):
            open_.clear()  # brackets not closed before the next declaration never are
        if token.kind in _CLOSES.values():
            open_.append(token)
        elif token.kind in _CLOSES:
            while open_ and open_[-1].kind != _CLOSES[token.kind]:
                open_.pop()
            if open_:
                first, last = _line(text, open_.pop()), _line(text, token)
                yield from _fold(first, last - 1 if token.starts_line else last)


def _declarations(text: OpenText) -> Iterator[types.FoldingRange]:
    """Yield the ranges of multi-line declarations, and of runs of single-line declarations with the same keyword."""
    spans = [(kind, _line(text, first), _line(text, last)) for kind, first, last in _spans(text.tokens)]
    for _, first, last in spans:
        yield from _fold(first, last)
    short = [(kind, first) for kind, first, last in spans if first == last]
    for (kind, _), lines in groupby(enumerate(short), key=lambda entry: (entry[1][0], entry[1][1] - entry[0])):
        places = [line for _, (_, line) in lines]
        yield from _fold(places[0], places[-1], types.FoldingRangeKind.Imports if kind == "include" else None)


def _spans(tokens: Iterable[Token]) -> Iterator[tuple[str, Token, Token]]:
    """Yield the keyword, first token and last token of each declaration that begins a line."""
    begun: Token | None = None
    last: Token | None = None
    for token in tokens:
        if _begins(token):
            if begun and last:
                yield begun.word, begun, last
            begun = token
        last = token
    if begun and last:
        yield begun.word, begun, last


def _begins(token: Token) -> bool:
    """Return whether a token begins both a line and a declaration."""
    return token.starts_line and token.declares


def _comments(text: OpenText) -> Iterator[types.FoldingRange]:
    written, places = text.source.text, text.places
    lines = [
        number
        for number, (start, end) in enumerate(zip(places.starts, places.ends, strict=True))
        if written[start:end].lstrip().startswith("#")
    ]
    for _, run in groupby(enumerate(lines), key=lambda entry: entry[1] - entry[0]):
        numbers = [line for _, line in run]
        yield from _fold(numbers[0], numbers[-1], types.FoldingRangeKind.Comment)


def _line(text: OpenText, token: Token) -> int:
    return text.places.line(token.span.start)


def _fold(first: int, last: int, kind: types.FoldingRangeKind | None = None) -> Iterator[types.FoldingRange]:
    if last > first:
        yield types.FoldingRange(start_line=first, end_line=last, kind=kind)
