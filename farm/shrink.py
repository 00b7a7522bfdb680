"""Shrinking of a mission's text that preserves a fault: by declarations, lines, words and numbers.

in   a text; a function that tells whether a text still has the fault
out  a text with the fault from which nothing more can be removed

Source:
    Zeller and Hildebrandt, *Simplifying and isolating failure-inducing input*, IEEE TSE 28 (2002): ``ddmin``, but
    not its test of subsets, which are seldom valid missions.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence

TOKEN = re.compile(r"\s+|\d+(?:\.\d+)?|\w+|\.\.|->|[<>=]=|[^\w\s]")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
OPENING, CLOSING = "([{", ")]}"
LONGEST_RUN = 16
"""Maximum number of words that are removed together."""

Still = Callable[[str], bool]


class _Enough(Exception):
    """Exception at the time limit."""


def shrunk(text: str, still: Still, seconds: float = 60.0) -> str:
    """Smallest text found within the time limit, or the text itself."""
    end, best = time.monotonic() + seconds, text
    known: dict[str, bool] = {}

    def shows(candidate: str) -> bool:
        nonlocal best
        if candidate not in known:
            if time.monotonic() > end:
                raise _Enough
            known[candidate] = still(candidate)
            if known[candidate] and len(candidate) <= len(best):
                best = candidate
        return known[candidate]

    try:
        before = ""
        while before != text:
            before = text
            for smaller in (_by_declarations, _by_lines, _without_brackets, _by_words, _by_numbers):
                text = smaller(text, shows)
    except _Enough:
        return best
    return text


def least(parts: Sequence[str], still: Callable[[list[str]], bool], longest: int | None = None) -> list[str]:
    """Parts in order from which no run can be removed; runs of all lengths down to one are tried.

    Args:
        longest: run that is tried; half of the parts where it is left out.
    """
    kept = list(parts)
    run = max(1, min(longest or len(kept), (len(kept) + 1) // 2))
    while True:
        place = 0
        while place < len(kept):
            fewer = kept[:place] + kept[place + run :]
            if still(fewer):
                kept = fewer
            else:
                place += run
        if run == 1:
            return kept
        run //= 2


def _by_declarations(text: str, still: Still) -> str:
    return "".join(least(list(declarations(text)), lambda parts: still("".join(parts))))


def _by_lines(text: str, still: Still) -> str:
    return "".join(least(text.splitlines(keepends=True), lambda parts: still("".join(parts))))


def _by_words(text: str, still: Still) -> str:
    return "".join(least(TOKEN.findall(text), lambda parts: still("".join(parts)), LONGEST_RUN))


def _without_brackets(text: str, still: Still) -> str:
    """Text without brackets around a part, and without their contents."""
    place = 0
    while True:
        tokens = TOKEN.findall(text)
        first, last = next((pair for pair in _pairs(tokens) if pair[0] >= place), (-1, -1))
        if first < 0:
            return text
        place = first + 1
        before, inside, after = tokens[:first], tokens[first + 1 : last], tokens[last + 1 :]
        for candidate in ([*before, *after], [*before, *inside, *after]):
            if still("".join(candidate)):
                text, place = "".join(candidate), first
                break


def _by_numbers(text: str, still: Still) -> str:
    """Text with simpler numbers."""
    tokens = TOKEN.findall(text)
    for place, token in enumerate(tokens):
        if NUMBER.fullmatch(token):
            for simpler in dict.fromkeys(("0", "1", "2", f"{float(token):.0f}", f"{float(token):.1f}")):
                if len(simpler) < len(token) or (len(simpler) == len(token) and simpler < token):
                    candidate = [*tokens[:place], simpler, *tokens[place + 1 :]]
                    if still("".join(candidate)):
                        tokens = candidate
                        break
    return "".join(tokens)


def declarations(text: str) -> Iterator[str]:
    """Parts of a text that begin at the margin, each with its indented or braced lines."""
    part, depth = "", 0
    for line in text.splitlines(keepends=True):
        if part and depth <= 0 and not line.startswith((" ", "\t", "}", "\n")):
            yield part
            part, depth = "", 0
        part += line
        depth += line.count("{") - line.count("}")
    if part:
        yield part


def _pairs(tokens: Sequence[str]) -> list[tuple[int, int]]:
    """Positions of the opening and closing of each bracket, in the order of opening."""
    found, open_ = [], []
    for place, token in enumerate(tokens):
        if token in OPENING:
            open_.append(place)
        elif token in CLOSING and open_:
            found.append((open_.pop(), place))
    return sorted(found)
