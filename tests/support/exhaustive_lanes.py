"""Small random missions on lanes, with an exhaustive search for jointly satisfiable requirements.

The semantics comes from ``tests.reference``, and collisions from the segments of motion, independent of any planner.
"""

from __future__ import annotations

import math
import random
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product

from missionc import ir
from missionc.base.source import Source
from missionc.base.units import Metres, Seconds
from missionc.compiler import driver
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lanes import Lane, LaneNode
from tests import reference

STEPS, RADIUS = 4, 0.3
"""Steps of 1 s in which an agent stays at a node or moves one lane of 1 m; radius of an agent, metres."""

Point = tuple[float, ...]

SHAPES = (
    ((1, 1), (2, 1), (3, 1), (4, 1), (5, 1)),
    ((1, 1), (2, 1), (3, 1), (4, 1), (2, 2)),
    ((1, 1), (2, 1), (3, 1), (2, 2), (2, 3)),
    ((1, 1), (2, 1), (2, 2), (1, 2), (3, 1)),
)
"""Nodes, metres: lanes in both directions connect any two that are 1 m apart."""

WORDS = ("a", "b", "c", "d", "e")
"""Region around each node."""


@dataclass(frozen=True)
class OnLanes:
    """Mission on lanes, in the form for a backend."""

    mission: ir.Mission
    kernel: Kernel

    @property
    def satisfied(self) -> frozenset[frozenset[str]]:
        """Names of the satisfied requirements, for each joint motion without collisions."""
        return frozenset(
            frozenset(each.name for each in self.mission.requirements if reference.truth(each.formula, run, 0, 0))
            for run in joint_motions(self.mission)
        )


def satisfiable(names: Collection[str], satisfied: Collection[frozenset[str]]) -> bool:
    """Return whether some joint motion satisfies all of these requirements."""
    return any(held.issuperset(names) for held in satisfied)


def joint_motions(mission: ir.Mission) -> Iterator[reference.Run]:
    """All motions of all agents along the lanes without collisions."""
    assert mission.solve.roadmap is not None
    places = [node.position for node in mission.solve.roadmap.nodes]
    ways = [list(_ways(agent.start.point, places)) for agent in mission.agents if agent.start.point is not None]
    assert len(ways) == len(mission.agents)
    apart = 2 * RADIUS
    for motion in product(*ways):
        if all(_nearest(one, other) >= apart for one, other in combinations(motion, 2)):
            velocities = [[_minus(after, before) for before, after in pairwise(way)] for way in motion]
            yield reference.Run(
                mission,
                [list(way) for way in motion],
                [[*each, each[-1]] for each in velocities],
                [[0.0] * len(way) for way in motion],
            )


def _ways(start: Point, places: list[Point]) -> Iterator[tuple[Point, ...]]:
    """Possible positions of one agent at each step."""
    ways = [(start,)]
    for _ in range(STEPS):
        ways = [(*way, place) for way in ways for place in places if math.dist(way[-1], place) <= 1]
    return iter(ways)


def _nearest(one: tuple[Point, ...], other: tuple[Point, ...]) -> float:
    """Minimum distance of two centres that move linearly between steps, metres."""
    offsets = [_minus(here, there) for here, there in zip(one, other, strict=True)]
    return min(_from_origin(before, after) for before, after in pairwise(offsets))


def _from_origin(before: Point, after: Point) -> float:
    """Distance of a segment from the origin."""
    way = _minus(after, before)
    length = sum(each * each for each in way)
    part = -sum(here * each for here, each in zip(before, way, strict=True)) / length if length else 0.0
    share = min(1.0, max(0.0, part))
    return math.hypot(*(here + share * each for here, each in zip(before, way, strict=True)))


def _minus(one: Point, other: Point) -> Point:
    return tuple(a - b for a, b in zip(one, other, strict=True))


def files_on_lanes(seed: int) -> dict[str, str]:
    """Files of a mission on lanes by name, ``m.mission`` first; `check` may reject it."""
    draw = random.Random(seed)
    places = draw.choice(SHAPES)
    text = _text(draw, places)
    if "team robot[1] {" in text:
        text = text.replace("graph radio = proximity 1.5 m\n", "")  # needs two agents
    text += 'solve with smt { roadmap = "lanes.graphml" }\n'
    return {"m.mission": text, "lanes.graphml": _graphml(places)}


def _graphml(places: tuple[tuple[int, int], ...]) -> str:
    named = list(zip(WORDS, places, strict=True))
    nodes = [f'<node id="{name}"><data key="x">{x}</data><data key="y">{y}</data></node>' for name, (x, y) in named]
    edges = [
        f'<edge source="{one}" target="{other}"/>'
        for (one, here), (other, there) in combinations(named, 2)
        if math.dist(here, there) == 1
    ]
    keys = [f'<key id="{each}" for="node" attr.name="{each}" attr.type="double"/>' for each in "xy"]
    graph = ['<graph edgedefault="undirected">', *nodes, *edges, "</graph>"]
    head = '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'
    return "\n".join([head, *keys, *graph, "</graphml>"]) + "\n"


def missions_on_lanes() -> Iterator[tuple[int, OnLanes]]:
    """Seeds whose missions pass `check`, with these missions."""
    seed = 0
    while True:
        draw = random.Random(seed)
        places = draw.choice(SHAPES)
        checked = driver.check(Source("lanes.mission", _text(draw, places)), backend="smt")
        if checked.ok:
            assert checked.mission is not None
            assert checked.kernel is not None
            solve = replace(checked.mission.solve, roadmap=_lanes(places, checked.mission))
            yield seed, OnLanes(replace(checked.mission, solve=solve), checked.kernel)
        seed += 1


def _lanes(places: tuple[tuple[int, int], ...], mission: ir.Mission) -> ir.Lanes:
    span = mission.requirements[0].span
    pairs = zip(WORDS, places, strict=True)
    nodes = tuple(LaneNode(name, tuple(Metres(float(each)) for each in place), span) for name, place in pairs)
    ends = product(range(len(places)), repeat=2)
    lanes = tuple(
        Lane(source, target, math.inf, Seconds(0.0), span)
        for source, target in ends
        if math.dist(places[source], places[target]) == 1
    )
    return ir.Lanes("lanes.graphml", nodes, lanes, span)


def _text(draw: random.Random, places: tuple[tuple[int, int], ...]) -> str:
    agents = draw.randint(1, 2)
    starts = ", ".join(f"({x}, {y})" for x, y in draw.sample(places, agents))
    lines = [
        f"mission on_lanes\ntime step 1 s, horizon {STEPS} s\nworld (0, 0) to (6, 4)",
        *(
            f"region {name} = box ({x - 0.4:g}, {y - 0.4:g}) to ({x + 0.4:g}, {y + 0.4:g})"
            for name, (x, y) in zip(WORDS, places, strict=True)
        ),
        f"team robot[{agents}] {{ radius {RADIUS} m  dynamics single_integrator(speed <= 1 m/s)  start at {starts} }}",
        "graph radio = proximity 1.5 m",
        *(f"require r{number}: {_requirement(draw, agents)}" for number in range(draw.randint(3, 5))),
    ]
    return "\n".join(lines) + "\n"


def _requirement(draw: random.Random, agents: int) -> str:
    here, there, other = draw.sample(WORDS, 3)
    who = draw.choice(["every robot:", "some robot:", f"robot[{draw.randrange(agents)}]:"])
    low = draw.randint(0, STEPS)
    window = f"[{low} s, {draw.randint(low, STEPS)} s]"
    one = [
        f"{who} eventually{window} {here}",
        f"{who} eventually[{STEPS} s, {STEPS} s] ({here} or {there})",
        f"{who} always{window} not {here}",
        f"{who} (not {here}) until[0, {STEPS} s] {there}",
        f"{who} ({here} until[1 s, 3 s] {there}) or ({here} until[1 s, 3 s] {other})",
        f"{who} eventually[0, 2 s] ({here} and eventually[0, 2 s] {there})",
        f"{who} eventually[0, 2 s] always[0, 2 s] {here}",
        f"{who} always[0, {STEPS} s] x <= 3.5",
    ]
    several = [
        f"always[0, {STEPS} s] connected(radio)",
        f"eventually{window} ((robot[0]: {here}) and (robot[1]: {there}))",
        f"always{window} distance(robot[0], robot[1]) >= 1.2",
        f"eventually{window} ((not connected(radio)) and (some robot: {here}))",
    ]
    return draw.choice(one + several if agents > 1 else one)
