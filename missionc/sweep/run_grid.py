"""The grid of a sweep: every combination of values, with every seed, in one order."""

from __future__ import annotations

import hashlib
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from missionc.sweep.varied_values import Varied, number_of

LONGEST_NAME = 120
"""Characters of a run's name: a folder of so long a name can be made everywhere."""
ODD = re.compile(r"[^A-Za-z0-9._=+-]+")

Combination = tuple[tuple[str, str], ...]
"""Parameters and the texts of their values."""


@dataclass(frozen=True, slots=True)
class Run:
    """One compilation of a sweep: by its values and its seed it is told from all others."""

    values: Combination
    seed: int

    @property
    def name(self) -> str:
        """The name of its folder, ``N=3_R=1.25_seed=0``; of what no file name should hold a hash stands in it."""
        whole = "_".join([*(f"{name}={_short(value)}" for name, value in self.values), f"seed={self.seed}"])
        plain = ODD.sub("-", whole)
        if plain == whole and len(whole) <= LONGEST_NAME:
            return whole
        digest = hashlib.sha256(whole.encode("utf-8", "replace")).hexdigest()[:8]
        return f"{plain[:LONGEST_NAME]}-{digest}"


def _short(value: str) -> str:
    """``1.5m``: a number and its unit without room between them; two values of a sweep are never that alike."""
    return value if number_of(value) is None else "".join(value.split())


@dataclass(frozen=True, slots=True)
class Grid:
    """All runs: the last parameter's value changes soonest, and of one combination the seeds."""

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
    """``N=3 R=1.25``; of nothing that is varied ``as written``."""
    return " ".join(f"{name}={value}" for name, value in values) or "as written"
