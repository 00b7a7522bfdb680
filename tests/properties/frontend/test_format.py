"""Formatting changes the layout and nothing else, and once is enough."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.frontend.syntax.show_tree import show
from missionc.frontend.syntax.tokens import tokenise
from tests.support.random_flight_missions import random_mission

MISSIONS = sorted((Path(__file__).resolve().parents[3] / "missions").glob("*.mission"))
COMMENT = re.compile(r"#[^\n]*")


def formatted(text: str) -> str:
    source = Source("a.mission", text)
    program, findings = parse(source, Limits(), unread)
    assert program is not None, findings
    return format_mission(source, program, Limits())


def tree(text: str) -> str:
    program, findings = parse(Source("a.mission", text), Limits(), unread)
    assert program is not None, findings
    return show(program)


def words(text: str) -> list[str]:
    return [token.text for token in tokenise(Span(Source("a.mission", text), 0, len(text)), Limits())[0]]


def comments(text: str) -> list[str]:
    return [found.rstrip() for found in COMMENT.findall(text)]


def same(text: str) -> None:
    once = formatted(text)
    assert formatted(once) == once
    assert words(once) == words(text)
    assert tree(once) == tree(text)
    assert comments(once) == comments(text)


def shaken(text: str, chance: random.Random) -> str:
    """Other white space, other line ends, and comments, wherever they may stand."""
    tokens, _ = tokenise(Span(Source("a.mission", text), 0, len(text)), Limits())
    parts: list[str] = []
    end = 0
    for token in tokens:
        gap = COMMENT.sub("", text[end : token.span.start])
        end = token.span.end
        if gap:
            gap = chance.choice(
                [" ", "  ", "\n", "\n\n\n", " # a note\n", "\n  # alone\n", "\n\n# one\n# two\n\n", "\t"]
            )
        parts.append(gap + token.text)
    return "".join(parts) + chance.choice(["", "\n", "\n\n\n", " # last", "\n# last\n"])


def test_a_real_mission_says_the_same(subtests: pytest.Subtests) -> None:
    assert MISSIONS
    for path in MISSIONS:
        with subtests.test(path.stem):
            text = path.read_text(encoding="utf-8")
            same(text)
            chance = random.Random(0)
            for _ in range(4):
                same(shaken(text, chance))


@given(st.integers(0, 2**32 - 1))
def test_a_random_mission_says_the_same(seed: int) -> None:
    text = random_mission(np.random.default_rng(seed))
    same(text)
    same(shaken(text, random.Random(seed)))


def test_the_layout() -> None:
    text = """

# what it is
mission   a   # named
time step 1 s,horizon ( T+2 s )   param T=4 s
region b=box(0,0)to( 1 , -1 )
obstacle  wall=disc at(1,1)radius 0.5 moving(2,0)m/s


# who
team drone[ 2 ]{radius 0.1 m dynamics unicycle( speed 1 .. 2 m/s )
start line(0, 0) to (1,1) # there
vehicle crazyflie21{speed<=0.5 m/s tracking 2 cm}
flight{pads at (1,2),(3,4) rise<=0.2 m/s}}
formation f=distances of drone(0-1:0.8)tolerance 0.1
require one:every drone:always[ 0,T ](b implies distance (b)<=2*x - -1)
prefer other:drone reach[hops 2 .. on radio]b
weight 2
"""
    assert (
        formatted(text)
        == """\
# what it is
mission a  # named
time step 1 s, horizon (T+2 s)
param T = 4 s
region   b    = box (0, 0) to (1, -1)
obstacle wall = disc at (1, 1) radius 0.5 moving (2, 0) m/s

# who
team drone[2] {
  radius   0.1 m
  dynamics unicycle(speed 1..2 m/s)
  start    line (0, 0) to (1, 1)  # there
  vehicle  crazyflie21 { speed <= 0.5 m/s  tracking 2 cm }
  flight   { pads at (1, 2), (3, 4)  rise <= 0.2 m/s }
}
formation f = distances of drone (0-1: 0.8) tolerance 0.1
require one:   every drone: always[0, T] (b implies distance(b) <= 2*x - -1)
prefer  other: drone reach[hops 2.. on radio] b
  weight 2
"""
    )
