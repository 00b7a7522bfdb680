"""Grid of a sweep: all combinations of parameter values, with all seeds, in a fixed order.

    in   ``N=3,5,8`` or ``R=1..2/0.25 m``
    out  Varied: the name and the texts of its values, in the order written; the grid of their combinations
    says MC760

A list has commas between its values. A range has its first value, two dots, its last value, and after a slash its step,
which is 1 by default. A unit after a range applies to all its values.
"""

from __future__ import annotations

import hashlib
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal

from missionc.base.diagnostics.code import SWEPT_VALUES
from missionc.base.diagnostics.model import Diagnostic

MOST_VALUES = 10_000
"""Maximum number of values of one parameter."""
MOST_RUNS = 1_000_000
"""Maximum number of runs of one sweep."""
NUMBER = r"[+-]?(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][+-]?\d+)?"
RANGE = re.compile(rf"\s*({NUMBER})\s*\.\.\s*({NUMBER})\s*(?:/\s*({NUMBER})\s*)?([^\W\d][\w/^*]*)?\s*")
PLAIN = re.compile(rf"\s*({NUMBER})\s*([^\W\d].*)?")
DIGITS = 40
"""Maximum length of a value in a message, characters."""


@dataclass(frozen=True, slots=True)
class Varied:
    """Parameter and the texts of its values."""

    name: str
    values: tuple[str, ...]


def read_varied(pairs: Sequence[tuple[str, str]], fixed: Sequence[str]) -> tuple[Varied, ...] | list[Diagnostic]:
    """Parse all varied parameters, or return all errors.

    Args:
        pairs: name and text of each parameter, as written.
        fixed: names of parameters with one value, from ``-D`` or ``--set``.
    """
    found: list[Varied] = []
    wrong: list[Diagnostic] = []
    for name, text in pairs:
        values = _values(text)
        if name in [each.name for each in found]:
            wrong.append(_refused(f"`{name}` is varied twice", "write all of its values in one `--vary`"))
        elif name in fixed:
            wrong.append(_refused(f"`{name}` is varied and also set to one value", "delete one of the two"))
        elif isinstance(values, str):
            wrong.append(_refused(f"in `--vary {name}={text[:DIGITS]}`: {values}", "write `N=3,5,8` or `R=1..2/0.25`"))
        else:
            found.append(Varied(name, values))
    return wrong or tuple(found)


def number_of(text: str) -> tuple[float, str] | None:
    """Number at the start of a value, and its unit; None if it is not a plain number."""
    match = PLAIN.fullmatch(text)
    return (float(match[1]), (match[2] or "").strip()) if match else None


def too_many(runs: int) -> Diagnostic | None:
    """Finding that a sweep has more runs than allowed, or None."""
    if runs <= MOST_RUNS:
        return None
    return _refused(f"the sweep has {runs:,} runs; the limit is {MOST_RUNS:,}", "use fewer values or seeds")


def _values(text: str) -> tuple[str, ...] | str:
    """Values that a text lists, or the error in it."""
    values: list[str] = []
    for part in text.split(","):
        if ".." in part:
            more = _range(part)
            if isinstance(more, str):
                return more
            values += more
        elif not part.strip():
            return "a value is empty"
        else:
            values.append(part.strip())
    if len(values) > MOST_VALUES:
        return f"{len(values)} values; the limit is {MOST_VALUES}"
    twice = next((value for number, value in enumerate(values) if _same(value) in map(_same, values[:number])), None)
    return tuple(values) if twice is None else f"duplicate value `{twice}`"


def _same(value: str) -> object:
    return number_of(value) or value


def _range(part: str) -> list[str] | str:
    match = RANGE.fullmatch(part)
    if match is None:
        return f"`{part.strip()[:DIGITS]}` is not a range FIRST..LAST/STEP"
    first, last, step = Decimal(match[1]), Decimal(match[2]), Decimal(match[3] or 1)
    if step <= 0:
        return f"the step {step} must be above 0"
    if last < first:
        return f"range reversed: {first} is greater than {last}"
    count = (last - first) / step
    if count > MOST_VALUES:
        return f"the range has {count:.3g} steps; the limit is {MOST_VALUES}"
    if count != int(count):
        return f"steps of {step} do not lead from {first} to {last}"
    unit = f" {match[4]}" if match[4] else ""
    return [f"{_plain(first + step * number)}{unit}" for number in range(int(count) + 1)]


def _plain(number: Decimal) -> str:
    """Decimal text of a number without trailing zeros, ``1.5`` rather than ``1.50``; 0 has no sign."""
    text = f"{number:f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


# ------------------------------------------------------------------ messages


def _refused(message: str, way_out: str) -> Diagnostic:
    return Diagnostic(SWEPT_VALUES, message, None, help=way_out)


LONGEST_NAME = 120
"""Maximum length of a run's name, which must be a valid folder name on all systems, characters."""
ODD = re.compile(r"[^A-Za-z0-9._=+-]+")

Combination = tuple[tuple[str, str], ...]
"""Names of the parameters with the text of one value each."""


@dataclass(frozen=True, slots=True)
class Run:
    """Compilation in a sweep, identified by its values and its seed."""

    values: Combination
    seed: int

    @property
    def name(self) -> str:
        """Name of the run's folder, ``N=3_R=1.25_seed=0``; a hash replaces invalid characters and long names."""
        whole = "_".join([*(f"{name}={_short(value)}" for name, value in self.values), f"seed={self.seed}"])
        plain = ODD.sub("-", whole)
        if plain == whole and len(whole) <= LONGEST_NAME:
            return whole
        digest = hashlib.sha256(whole.encode("utf-8", "replace")).hexdigest()[:8]
        return f"{plain[:LONGEST_NAME]}-{digest}"


def _short(value: str) -> str:
    """Value without spaces, such as ``1.5m``; different values of a sweep stay different."""
    return value if number_of(value) is None else "".join(value.split())


@dataclass(frozen=True, slots=True)
class Grid:
    """All runs in order: the last parameter varies fastest, and within a combination the seed."""

    varied: tuple[Varied, ...]
    seeds: int

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(each.name for each in self.varied)

    @property
    def combinations(self) -> list[Combination]:
        return [
            tuple(zip(self.names, values, strict=True))
            for values in itertools.product(*(each.values for each in self.varied))
        ]

    def __len__(self) -> int:
        count = self.seeds
        for each in self.varied:
            count *= len(each.values)
        return count

    def runs(self) -> Iterator[Run]:
        for values in self.combinations:
            for seed in range(self.seeds):
                yield Run(values, seed)


def words(values: Sequence[tuple[str, str]]) -> str:
    """Text of a combination: ``N=3 R=1.25``, or ``as written`` without varied parameters."""
    return " ".join(f"{name}={value}" for name, value in values) or "as written"
