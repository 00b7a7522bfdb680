"""Texts of real missions with random changes: words dropped, doubled, swapped and borrowed."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

TOKEN = re.compile(r"\s+|#[^\n]*|\w+|[^\w\s]")
ODD = (
    *(
        "",
        "\0",
        "\ufeff",
        "\u202e",
        "é",
        "𝄞",
        '"',
        "'",
        "\\",
        "#",
        "\n",
        "\t",
        "[",
        "]",
        "{",
        "}",
        "(",
        ")",
        "..",
        "->",
    ),
    *("0", "-1", "1e400", "1e-400", "0.1", "99999999999999999999", "3 s", "3 m", "3 steps", "nan", "inf", "0..0"),
    *("every", "some", "not", "always[0, 3 s]", "eventually[0, end]", "reach[hops 0..2]", "escape[hops 1..]", "until"),
    *("drone[0]", "drone[0..1]", "drone[7]", "true", "false", "let", "require", "include", "param", "team", "region"),
    *("distance(base)", "x <= 3", "speed", "connected(radio)", "box (0, 0) to (1, 1)", "moving (1, 0) m/s", "* 0"),
)
FORMULAS = (
    "every drone: always[0, end] (base or not base)",
    "some drone: next next drone[0]: base",
    "every drone: (drone U[0, 3 s] base) & !(x + 2*y <= 3 | speed > 1)",
    "at least 2 drone: eventually[1 s, 4 s] count[hops 1..2 on radio] drone >= 2",
    "drone[0]: everywhere[distance <= 5 m on radio] (drone surround[hops <= 2 on radio] base)",
    "drone[1]: escape[hops 1.. on radio] drone -> drone[0]: distance(drone[1]) >= 0.3 m",
    "always[0, 5 s] connected(radio) and eventually[0, 5 s] distance(drone[0], drone[1]) <= 2",
    "every drone: (base release[0, 2 s] drone) iff touches(base)",
    "not (every drone: inside(base)) implies some drone: altitude >= 1",
)
CORPUS = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "missions").glob("*.mission"))]
SMALLEST = [text for text in CORPUS if len(text) < 1200]

Mutation = Callable[[list[str], random.Random], None]


def drop(tokens: list[str], chance: random.Random) -> None:
    del tokens[chance.randrange(len(tokens))]


def double(tokens: list[str], chance: random.Random) -> None:
    place = chance.randrange(len(tokens))
    tokens.insert(place, tokens[place])


def swap(tokens: list[str], chance: random.Random) -> None:
    one, other = chance.randrange(len(tokens)), chance.randrange(len(tokens))
    tokens[one], tokens[other] = tokens[other], tokens[one]


def replace(tokens: list[str], chance: random.Random) -> None:
    tokens[chance.randrange(len(tokens))] = chance.choice(ODD)


def insert(tokens: list[str], chance: random.Random) -> None:
    tokens.insert(chance.randrange(len(tokens) + 1), chance.choice(ODD))


def borrow(tokens: list[str], chance: random.Random) -> None:
    """Insert a run of tokens from another mission."""
    others = TOKEN.findall(chance.choice(CORPUS))
    begin = chance.randrange(len(others))
    place = chance.randrange(len(tokens) + 1)
    tokens[place:place] = others[begin : begin + chance.randrange(1, 30)]


def cut(tokens: list[str], chance: random.Random) -> None:
    del tokens[chance.randrange(1, len(tokens) + 1) :]


def number(tokens: list[str], chance: random.Random) -> None:
    places = [place for place, token in enumerate(tokens) if token.isdigit()]
    if places:
        tokens[chance.choice(places)] = chance.choice(
            ["0", "1", "2", "7", "100", "1000000", "0.5", "-3", "1e9", "9" * 40]
        )


def name(tokens: list[str], chance: random.Random) -> None:
    """Replace a word by another: existing names in unsuitable places."""
    places = [place for place, token in enumerate(tokens) if token.isidentifier()]
    if places:
        tokens[chance.choice(places)] = tokens[chance.choice(places)]


def require(tokens: list[str], chance: random.Random) -> None:
    """Add a formula, of a form that the mission may not have."""
    tokens += TOKEN.findall(f"\nrequire {chance.choice(FORMULAS)}\n")


def line(tokens: list[str], chance: random.Random) -> None:
    """Remove a line, or add one from another mission."""
    breaks = [place for place, token in enumerate(tokens) if "\n" in token]
    if len(breaks) > 1 and chance.random() < 0.5:
        first = chance.randrange(len(breaks) - 1)
        del tokens[breaks[first] : breaks[first + 1]]
    elif breaks:
        place = chance.choice(breaks)
        tokens[place:place] = ["\n", *TOKEN.findall(chance.choice(chance.choice(CORPUS).splitlines())), "\n"]


MUTATIONS: tuple[Mutation, ...] = (drop, double, swap, replace, insert, borrow, cut)
MEANINGFUL: tuple[Mutation, ...] = (number, name, require, line)
"""Changes that mostly leave a text that parses."""


def mutated(seed: int) -> str:
    """One of the smallest missions with a change, reproducible by seed."""
    chance = random.Random(seed)
    return _changed(chance.choice(SMALLEST), chance)


def mutated_of(text: str, seed: int) -> str:
    """The text with a change."""
    return _changed(text, random.Random(seed))


def nudged(text: str, seed: int) -> str:
    """The text with a changed number, name or requirement: it mostly still parses, and often still checks."""
    chance = random.Random(seed)
    tokens = TOKEN.findall(text)
    for _ in range(chance.choice((1, 1, 2))):
        chance.choice((number, number, name, require))(tokens, chance)
    return "".join(tokens)


def _changed(text: str, chance: random.Random) -> str:
    tokens = TOKEN.findall(text)
    for _ in range(chance.choice((1, 1, 2, 3, 4, 8))):
        chance.choice(MUTATIONS if chance.random() < 0.25 else MEANINGFUL)(tokens, chance)
        tokens = tokens or [""]
    return "".join(tokens)
