"""Whatever a mission says, resolve answers it, and a mission that comes out can be trusted."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass

from hypothesis import given
from hypothesis import strategies as st

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.resolve.show_ir import show_ir
from missionc.frontend.syntax.parse import parse
from missionc.ir.language.operator import Operator

MISSION = """mission everything
param T = 20 s
param N = 4
time step 0.5 s, horizon T
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (3, 3)
region fire = disc at (5.2, 5.2) radius 1 m
region field = polygon (3, 3), (4, 3.2), (3.6, 4.2)
region wet = field - fire + base * base
obstacle ridge = box (3, 7) to (4, 9)
obstacle truck = disc at (2, 5) radius 50 cm moving (0.2, 0) m/s
obstacle train = box (0, 0) to (1, 1) along (0 s: 0, 0), (4 s: 3, 0), (9 s: 3, 5) uncertain 0.1 m/s
beacon mast = (1.5, 1.5)
team drone[N] { radius 0.1 m  dynamics unicycle(speed 1..2 m/s, turn <= 90 deg/s)  start grid (1, 1) to (3, 3) }
team cart[3] { dynamics double_integrator(speed <= 1, acceleration <= 2)  start line (1, 1) to (3, 1)  finish in wet }
agent scout { dynamics single_integrator(speed <= 3 m/s)  start at (1, 1)  finish at (9, 9) }
group east = drone[0..2], scout
graph radio = proximity 1 m
graph cell = beacons 2.5 m over east
formation wall = line of drone spacing 0.8 m heading 90 deg tolerance 0.1 m
formation row = chain of cart spacing 0.8 m total tolerance 0.1 m
formation fleet = grid of drone spacing 0.8 m tolerance 0.1 m
formation round = circle of drone[1..3] radius 0.8 m tolerance 0.1 m
formation wedge = offsets of cart (0, 0), (-1, 1), (-1, -1) tolerance 0.2 m
formation ring = distances of cart (0-1: 0.8, 1-2: 0.8) tolerance 0.1 m
separation 0.3 m
clearance 0.1 m
let safe = not fire and (x + 2 * y <= 30 or distance(mast) >= 1)
require relay: every drone: always[0, T] (field implies safe reach[hops 0..2 on radio] base)
require rescue: at least 2 cart: eventually[0, 12 s] inside(field)
require shape: (wall or row) until[2 s, end] (fleet and round and connected(radio, east))
require apart: always[2 steps, 9 steps] distance(drone[0], scout) >= 1 m
require seen: scout: count[distance 0..3 m on cell] (ring_safe or cart) >= 1
let ring_safe = escape[hops 1.. on radio] touches(wet)
require close: wedge or not ring
prefer calm: every drone: always[0, T] speed <= 1.5 m/s weight 2
minimize distance
tolerate delay 2 s of drone[0..1]
solve with smt { nodes = 110, neighbors = 6 }
"""

NAMES = tuple(
    re.findall(r"^(?:param|region|obstacle|beacon|team|agent|group|graph|formation|let) (\w+)", MISSION, re.M)
)
"""What the mission declares; its other words are the language's, and changing those is the parser's affair."""

WORD = re.compile(rf"\b(?P<name>{'|'.join(NAMES)})\b|(?P<number>[0-9]+(?:\.[0-9]+)?)|(?P<sign>[-+*<>])")
PLACES = tuple(WORD.finditer(MISSION))
BY_KIND = {"name": NAMES, "number": ("2", "3.5", "12"), "sign": tuple("-+*/<>")}
ODD = {
    "name": ("nothing", "x", "speed", "z", "true"),
    "number": ("0", "1", "0.3", "7", "(1 / 0)", "N", "T", "-1", "1000000000", "(2 m)", "30 deg"),
    "sign": ("",),
}


FIGURES = ir.FIGURES | ir.PAD_FIGURES
INFINITE = {"turn", "high", *(name for name, figure in FIGURES.items() if figure.relation == "<=")}
"""Where nothing limits it; ``low`` and ``high`` of a vehicle's band likewise."""


@st.composite
def mutated(draw: st.DrawFn) -> str:
    """The mission with one to three of its words replaced by others of their kind."""
    chosen = draw(st.lists(st.integers(0, len(PLACES) - 1), min_size=1, max_size=3, unique=True))
    text = MISSION
    for index in sorted(chosen, reverse=True):
        place = PLACES[index]
        kind = place.lastgroup or ""
        text = text[: place.start()] + draw(st.sampled_from(BY_KIND[kind] + ODD[kind])) + text[place.end() :]
    return text


def numbers(root: object) -> Iterator[tuple[str, float]]:
    """Every float below a value, with the name of the field that holds it."""
    waiting: list[tuple[str, object]] = [("", root)]
    seen: set[int] = set()
    while waiting:
        name, value = waiting.pop()
        if isinstance(value, float):
            yield name, value
        elif isinstance(value, tuple):
            waiting.extend((name, item) for item in value)
        elif is_dataclass(value) and not isinstance(value, Span | Operator) and id(value) not in seen:
            seen.add(id(value))
            waiting.extend((entry.name, getattr(value, entry.name)) for entry in fields(value))


def resolved(text: str) -> tuple[ir.Mission | None, list[Diagnostic]]:
    refuse = Diagnostic(code.INCLUDE_NOT_ALLOWED, "no files here", None)
    program, found = parse(Source("everything.mission", text), Limits(), lambda path, span: refuse)
    return (None, found) if program is None else resolve(program, {}, Limits())


def test_the_mission_that_is_mutated_has_no_errors() -> None:
    mission, found = resolved(MISSION)
    assert mission is not None
    assert found == []


@given(mutated())
def test_a_mutated_mission_is_answered_and_what_comes_out_is_sound(text: str) -> None:
    mission, found = resolved(text)
    assert (mission is None) == has_errors(found)
    assert all(finding.message and finding.help for finding in found)
    if mission is None:
        return
    for name, value in numbers(mission):
        assert (
            math.isfinite(value) or (value == math.inf and name in INFINITE) or (value == -math.inf and name == "low")
        )
    everyone = range(len(mission.agents))
    for agents in (*mission.teams, *mission.groups, *mission.graphs, *mission.formations):
        assert set(agents.agents) <= set(everyone)
    assert [agent.index for agent in mission.agents] == list(everyone)
    assert show_ir(mission)
