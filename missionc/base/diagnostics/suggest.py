"""Spelling suggestions by edit distance: the known name that is most similar to a misspelled one."""

from __future__ import annotations

from collections.abc import Iterable


class Nothing:
    """Marker for the case that no known name is similar enough to the misspelled word."""


NOTHING = Nothing()


def edits(first: str, second: str) -> int:
    """Edit distance of two words: number of letters to insert, delete, replace or swap with a neighbour."""
    above: list[int] = []
    last = list(range(len(second) + 1))
    for row, letter in enumerate(first, start=1):
        current = [row]
        for column, other in enumerate(second, start=1):
            cost = min(last[column] + 1, current[-1] + 1, last[column - 1] + (letter != other))
            if row > 1 and column > 1 and letter == second[column - 2] and other == first[row - 2]:
                cost = min(cost, above[column - 2] + 1)
            current.append(cost)
        above, last = last, current
    return last[-1]


def suggestion(word: str, names: Iterable[str], otherwise: str) -> str:
    """Question "did you mean …?" with the most similar name, or the advice ``otherwise`` if no name is similar
    enough."""
    near = nearest(word, names)
    return f"did you mean `{near}`?" if isinstance(near, str) else otherwise


def nearest(word: str, names: Iterable[str]) -> str | Nothing:
    """Name with the smallest edit distance to the word (the first of equals); ``NOTHING`` if over a third of the word
    differs."""
    lowered = word.lower()
    allowed = max(1, len(word) // 3) if len(word) > 1 else 0
    best: tuple[int, str | Nothing] = (allowed + 1, NOTHING)
    for name in names:
        if abs(len(name) - len(word)) < best[0]:
            best = min(best, (edits(lowered, name.lower()), name), key=lambda pair: pair[0])
    return best[1]
