"""One sentence for what is asked with each value of an index, where the sentences for the values differ in it alone.

The sentence with the index is the sentences without it: every number in which they differ has to be the same sum of the
indices in all of them (``2*i + 1``), or there is none.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from fractions import Fraction

from missionc.base.source import Turn

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?!\w)")
"""Numbers by themselves: no digits of a name."""


def indices(turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """```i` from 0 to 9``, of these values; None where they are not all there are, or one range rests on another."""
    first = turns[0]
    if len(turns) < 2 or len({tuple((turn.name, turn.low, turn.high) for turn in each) for each in turns}) > 1:
        return None
    count = 1
    for turn in first:
        count *= turn.high - turn.low + 1
    if count != len(turns):
        return None
    each = [f"`{turn.name}` from {turn.low} to {turn.high}" for turn in first if turn.low < turn.high]
    return f"{', '.join(each[:-1])} and {each[-1]}" if len(each) > 1 else each[0]


def for_each_index(texts: Sequence[str], turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """``for each `i` from 0 to 9: …``, a sentence or a part of one as the texts are, or None where there is no such."""
    said, each = (with_indices(texts, turns), indices(turns)) if turns[0] else (None, None)
    if said is None or each is None:
        return None
    ended = said.endswith(".")
    return f"{'For' if ended else 'for'} each {each}: {said[0].lower() + said[1:] if ended else said}"


def with_indices(texts: Sequence[str], turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """The text that gives each of ``texts`` with the values of its turns, or None where there is no such text."""
    pieces = [_NUMBER.split(text) for text in texts]
    if any(piece != pieces[0] for piece in pieces):
        return None
    numbers = [[Fraction(number) for number in _NUMBER.findall(text)] for text in texts]
    written, said = _NUMBER.findall(texts[0]), [pieces[0][0]]
    for place, values in enumerate(zip(*numbers, strict=True)):
        number = written[place]
        if len(set(values)) > 1:
            formula = _sum_of_indices(values, turns)
            if formula is None:
                return None
            before = "".join(said)
            inside = before.count("`") % 2 == 1 or before.count("[") > before.count("]")
            number = formula if inside else f"`{formula}`"
        said += [number, pieces[0][place + 1]]
    return "".join(said)


def _sum_of_indices(values: Sequence[Fraction], turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """``2*i + 1``: a constant and so many times each index, which is each of the values."""
    at = {tuple(turn.value for turn in each): value for each, value in zip(turns, values, strict=True)}
    low = tuple(turn.low for turn in turns[0])
    weights = []
    for place, turn in enumerate(turns[0]):
        step = tuple(value + (number == place) for number, value in enumerate(low))
        weights.append(at[step] - at[low] if turn.high > turn.low else Fraction(0))
    constant = at[low] - sum(weight * value for weight, value in zip(weights, low, strict=True))
    if any(
        value != constant + sum(weight * each for weight, each in zip(weights, place, strict=True))
        for place, value in at.items()
    ):
        return None
    return _joined([*_products(weights, turns[0]), *([(constant, _decimal(abs(constant)))] if constant else [])])


def _products(weights: Sequence[Fraction], turns: tuple[Turn, ...]) -> Iterator[tuple[Fraction, str]]:
    for weight, turn in zip(weights, turns, strict=True):
        if weight:
            yield weight, turn.name if abs(weight) == 1 else f"{_decimal(abs(weight))}*{turn.name}"


def _joined(parts: list[tuple[Fraction, str]]) -> str:
    (sign, first), *rest = parts
    return ("-" if sign < 0 else "") + first + "".join(f" {'-' if sign < 0 else '+'} {text}" for sign, text in rest)


def _decimal(value: Fraction) -> str:
    return f"{float(value):.10g}"
