"""Call sites: the Python expression that built a part of a mission, as a span of its file."""

from __future__ import annotations

import linecache
import os
import sys
from functools import lru_cache
from itertools import islice
from pathlib import Path
from types import CodeType

from missionc.base.source import Source, Span

PACKAGE = __name__.partition(".")[0]


def call_site() -> Span:
    """Span of the Python expression that runs in the innermost function outside this package.

    The span is empty, and its source has no text, if Python does not have the text, for instance in an interactive
    interpreter.
    """
    frame = sys._getframe(1)
    while frame.f_globals.get("__name__", "").partition(".")[0] == PACKAGE and frame.f_back is not None:
        frame = frame.f_back
    return _expression(frame.f_code, frame.f_lasti)


@lru_cache(maxsize=4096)
def _expression(code: CodeType, instruction: int) -> Span:
    source = _source(code.co_filename)
    first, last, begin, end = next(islice(code.co_positions(), instruction // 2, None))
    if not source.text or first is None or not 1 <= first <= len(source.line_starts):
        return Span(source, 0, 0)
    if last is None or begin is None or end is None:  # Python was told not to keep line numbers
        text = source.line(first)
        start = source.line_starts[first - 1]
        return Span(source, start + len(text) - len(text.lstrip()), start + len(text))
    return Span(source, _offset(source, first, begin), _offset(source, last, end))


def _offset(source: Source, line: int, column: int) -> int:
    """Character offset in the source of a column, which Python counts in bytes of UTF-8."""
    return source.line_starts[line - 1] + len(source.line(line).encode()[:column].decode(errors="ignore"))


@lru_cache(maxsize=256)
def _source(file: str) -> Source:
    linecache.checkcache(file)
    name = os.path.relpath(file) if Path(file).is_relative_to(Path.cwd()) else file
    return Source(name, "".join(linecache.getlines(file)))
