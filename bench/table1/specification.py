r"""Mission as a formula tree of stlpy, whose signal is the concatenation of all positions.

All approximations are conservative: a disc is its circumscribed octagon, two bodies are separated along x or along y,
the required links are those of the starts' minimum spanning tree, each with \|dx\| and \|dy\| at most range/√2. stlpy
has no time between the steps. ``between`` adds a sufficient condition for it: the same side of an obstacle, or of
another body, at two consecutive steps.
"""

from __future__ import annotations

import typing

import numpy as np
from stlpy.STL import LinearPredicate
from stlpy.STL.formula import STLTree

from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.base.trace import Array
from missionc.ir import Box, Compare, Connected, Disc, Inside, Mission, Proximity, Shape, Touches, Union
from missionc.ir.kernel.nodes import All, Always, Any, At, Atom, Eventually, Kernel, Node, Not, Until
from missionc.ir.predicates.features import Coordinate
from table1.scene import Unsupported, box, tree

Stl: typing.TypeAlias = typing.Any
"""Formula of stlpy, which has no types."""

GUARD = 1e-3
"""Margin of every predicate in metres, so that a solver's tolerance does not decide."""

SIDES = 8
"""Number of sides of the polygon for a disc."""


def specification(mission: Mission, kernel: Kernel, start: Array, between: bool = False, guard: float = GUARD) -> Stl:
    """Requirements, finishes in regions, obstacles and pairs, from ``start``, (agents, 2), metres."""
    write = _Writer(mission, tree(start), between, guard)
    parts = [write.term(wanted.formula, None) for wanted in build(kernel).requirements]
    last = mission.steps
    for agent in mission.agents:
        if agent.finish is not None and agent.finish.point is None:
            parts.append(write.inside(agent.index, box(agent.finish), 0.0).always(last, last))
        for obstacle in mission.obstacles:
            gap = agent.radius + mission.clearance
            parts.append(write.outside(agent.index, obstacle.shape, gap))
    parts.extend(
        write.apart(one.index, other.index, one.radius + other.radius + mission.separation)
        for one in mission.agents
        for other in mission.agents[: one.index]
    )
    return both(parts, "and")


def both(parts: list[Stl], how: str) -> Stl:
    return parts[0] if len(parts) == 1 else STLTree(parts, how, [0] * len(parts))


class _Writer:
    def __init__(self, mission: Mission, links: list[tuple[int, int]], between: bool, guard: float) -> None:
        self.mission, self.size, self.links, self.between = mission, 2 * len(mission.agents), links, between
        self.last, self.guard = mission.steps, guard

    def term(self, term: Node, agent: int | None) -> Stl:
        match term:
            case All(parts):
                return both([self.term(part, agent) for part in parts], "and")
            case Any(parts):
                return both([self.term(part, agent) for part in parts], "or")
            case Always(body, low, high):
                return self.term(body, agent).always(low, self.last if high is None else high)
            case Eventually(body, low, high):
                return self.term(body, agent).eventually(low, self.last if high is None else high)
            case At(one, body):
                return self.term(body, one)
            case Until(hold, goal, low, high):
                early = [self.term(hold, agent).always(0, low - 1)] if low else []
                before_goal = self.term(hold, agent).until(
                    self.term(goal, agent), low, self.last if high is None else high
                )
                return both([*early, before_goal], "and")
            case Atom(Inside(region, body)) if agent is not None and not body:
                return both([self.inside(agent, part, 0.0) for part in boxes(region.shape)], "or")
            case Not(Atom(Inside(region, body))) if agent is not None and not body:
                return both([self.leave(agent, part, 0.0) for part in boxes(region.shape)], "and")
            case Not(Atom(Touches(region))) if agent is not None:
                radius = self.mission.agents[agent].radius
                return both([self.leave(agent, part, radius) for part in boxes(region.shape)], "and")
            case Atom(Compare(terms, constant)) if agent is not None:
                weights = [0.0, 0.0]
                for weight, feature in terms:
                    if not isinstance(feature, Coordinate):
                        raise Unsupported(f"no linear form of {term}")
                    weights[feature.axis] += weight
                return self.half({agent: (weights[0], weights[1])}, -constant)
            case Atom(Connected(Proximity() as graph)):
                return both([self.near(*link, graph.radius) for link in self.links], "and")
        raise Unsupported(f"no linear form of {term}")

    def half(self, weights: dict[int, tuple[float, float]], bound: float) -> Stl:
        """Predicate that the weighted sum of each agent's position is at least the bound."""
        row = np.zeros((1, self.size))
        for agent, (x, y) in weights.items():
            row[0, 2 * agent], row[0, 2 * agent + 1] = x, y
        return LinearPredicate(row, np.array([bound + self.guard]))

    def inside(self, agent: int, area: Box, room: float) -> Stl:
        sides = []
        for axis, normal in enumerate([(1.0, 0.0), (0.0, 1.0)]):
            sides.append(self.half({agent: normal}, area.low[axis] + room))
            sides.append(self.half({agent: (-normal[0], -normal[1])}, room - area.high[axis]))
        return both(sides, "and")

    def leave(self, agent: int, shape: Shape, gap: float) -> Stl:
        """Formula for being outside a shape at one step."""
        return both([self.half({agent: normal}, bound + gap) for normal, bound in sides_of(shape)], "or")

    def outside(self, agent: int, shape: Shape, gap: float) -> Stl:
        return self.beyond([self.half({agent: normal}, bound + gap) for normal, bound in sides_of(shape)])

    def apart(self, one: int, other: int, gap: float) -> Stl:
        normals = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
        return self.beyond([self.half({one: (x, y), other: (-x, -y)}, gap) for x, y in normals])

    def beyond(self, sides: list[Stl]) -> Stl:
        """Formula for staying beyond one of the sides at every step, or throughout every move."""
        if self.between:
            return both([side.always(0, 1) for side in sides], "or").always(0, self.last - 1)
        return both(sides, "or").always(0, self.last)

    def near(self, one: int, other: int, reach: float) -> Stl:
        normals = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
        most = reach / np.sqrt(2)
        return both([self.half({one: (x, y), other: (-x, -y)}, -most) for x, y in normals], "and")


def boxes(shape: Shape) -> list[Box]:
    """Boxes of which a shape is the union."""
    match shape:
        case Box():
            return [shape]
        case Union(left, right):
            return [*boxes(left), *boxes(right)]
        case _:
            raise Unsupported(f"a region of shape {type(shape).__name__}")


def sides_of(shape: Shape) -> list[tuple[tuple[float, float], float]]:
    """Outward normals and offsets of a convex polygon around a shape."""
    match shape:
        case Box(low, high):
            return [((-1.0, 0.0), -low[0]), ((1.0, 0.0), high[0]), ((0.0, -1.0), -low[1]), ((0.0, 1.0), high[1])]
        case Disc(centre, radius, None):
            turns = 2 * np.pi * np.arange(SIDES) / SIDES
            normals = [(float(np.cos(turn)), float(np.sin(turn))) for turn in turns]
            return [((x, y), x * centre[0] + y * centre[1] + radius) for x, y in normals]
        case _:
            raise Unsupported(f"an obstacle of shape {type(shape).__name__}")
