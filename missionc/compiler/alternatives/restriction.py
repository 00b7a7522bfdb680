"""Restrictions that forbid one decision of a plan: a disjunct, an order of events, or a homotopy class.

    in   Mission, Kernel, the restriction
    out  a Mission and a Kernel whose plans satisfy the mission with other decisions

Any backend can plan the restricted mission: a choice loses branches, an order becomes a requirement, and a homotopy
class becomes an obstacle. Infeasibility of the restricted mission says nothing about the original one.

Source:
    Murty 1968, Lawler 1972, the k best solutions by partitioning the remaining ones.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import field, replace
from typing import TypeAlias

import numpy as np
import shapely

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.winding import StandingPart, least_room, outline
from missionc.ir import Mission, Obstacle, Polygon, Prism, Shape, Still
from missionc.ir.kernel.choices import ChoicePoint, branches, without, witnesses
from missionc.ir.kernel.nodes import All, At, Goal, Kernel, Node, Until
from missionc.ir.kernel.normal_form import negated
from missionc.verification.monitoring.signature import Event, Signature

BARRED = "barred"
"""Name of a barrier, an obstacle in planning only; it is not an identifier, so no mission uses it."""

THICK = 1 / 150
"""Thickness of a barrier, as a fraction of the world's longer side."""

PASSING = np.pi / 3
"""Minimum angle, radians, that an agent sweeps about an obstacle that it passes."""

LOOKED_AT = 24
"""Number of points of a path from which barriers are tried."""

MOST_ORDERS = 24
"""Maximum number of orders of events in a plan that are reversed, each separately."""

Bar: TypeAlias = tuple[tuple[float, float], ...]
"""Corners of a barrier's area, metres."""


class Restriction(Record):
    """A set of forbidden decisions.

    Args:
        removed: indices of the removed branches of choices.
        first: required orders: pairs, the earlier event first.
        barred: corners of the barriers' areas.
    """

    removed: dict[ChoicePoint, frozenset[int]] = field(default_factory=dict)
    first: tuple[tuple[Event, Event], ...] = ()
    barred: tuple[Bar, ...] = ()

    @property
    def key(self) -> Hashable:
        """Hashable key that is equal for equal restrictions."""
        pairs = frozenset((one.asked, other.asked) for one, other in self.first)
        return frozenset(self.removed.items()), pairs, frozenset(self.barred)

    def applied(self, mission: Mission, kernel: Kernel) -> tuple[Mission, Kernel]:
        """The mission and kernel with the restriction: barriers as obstacles, and changed requirements."""
        barred = tuple(
            Obstacle(f"{BARRED} {number}", _prism(mission, corners), Still(), mission.span)
            for number, corners in enumerate(self.barred)
        )
        narrower = replace(mission, obstacles=(*mission.obstacles, *barred)) if barred else mission
        return narrower, replace(kernel, requirements=tuple(map(self._goal, kernel.requirements)))

    def _goal(self, goal: Goal) -> Goal:
        formula = without(goal.formula, self.removed)
        orders = [_in_order(*pair) for pair in self.first if pair[1].requirement == goal.name]
        formula = All((formula, *orders)) if orders else formula
        return goal if formula is goal.formula else replace(goal, formula=formula)


def restrictions(
    before: Restriction, signature: Signature, mission: Mission, position: Array, sides: bool = True
) -> Iterator[Restriction]:
    """Yield restrictions that each forbid one further decision of a plan.

    Disjuncts, orders of events and homotopy classes alternate, so that a few attempts include each kind.

    Args:
        before: restriction under which the plan was found; each result includes it.
        position: positions of the plan, (agents, steps + 1, dim), metres.
        sides: True to forbid homotopy classes too.
    """
    kinds = [_options(before, signature), _orders(before, signature)]
    if sides:
        kinds.insert(1, _sides(before, signature, mission, position))
    while kinds:
        for kind in list(kinds):
            made = next(kind, None)
            if made is None:
                kinds.remove(kind)
            else:
                yield made


def _options(before: Restriction, signature: Signature) -> Iterator[Restriction]:
    for asked, options in signature.options.items():
        enough = witnesses(asked)
        gone = before.removed.get(asked, frozenset())
        drop = frozenset(sorted(options.true - gone)[enough - 1 :]) | gone
        if len(branches(asked)) - len(drop) >= enough:
            yield replace(before, removed={**before.removed, asked: drop})


def _orders(before: Restriction, signature: Signature) -> Iterator[Restriction]:
    settled = {frozenset((one.asked, other.asked)) for one, other in before.first}
    pairs = [pair for pair in signature.pairs if frozenset(each.asked for each in pair) not in settled]
    for first, second in pairs[:MOST_ORDERS]:
        yield replace(before, first=(*before.first, (second, first)))


def _sides(before: Restriction, signature: Signature, mission: Mission, position: Array) -> Iterator[Restriction]:
    """Yield restrictions with a barrier: first those that a group of agents must circumvent together, then short
    barriers.

    Args:
        position: positions of the plan, (agents, steps + 1, dim), metres.
    """
    turns = [
        (-abs(float(signature.swept[agent, number])), number, agent, sign)
        for number in range(len(signature.parts))
        for sign in (1, -1)
        for agent in [int(np.argmax(sign * signature.swept[:, number]))]
        if sign * signature.swept[agent, number] > PASSING
    ]
    short: list[Bar] = []
    for _, number, agent, sign in sorted(turns):
        company = np.flatnonzero(sign * signature.swept[:, number] > PASSING)
        bars = _bars(mission, signature.parts[number], position[agent, :, :2], position[company, :, :2])
        for corners in bars[:1]:
            if _leaves_ways(mission, (*before.barred, corners), position):
                yield replace(before, barred=(*before.barred, corners))
        short.extend(bars[1:])
    for corners in short:
        if _leaves_ways(mission, (*before.barred, corners), position):
            yield replace(before, barred=(*before.barred, corners))


def _in_order(first: Event, second: Event) -> Node:
    """Formula: the first event occurs by its deadline, and the second event does not occur before it."""
    early, late = first.asked, second.asked
    last = min(first.last, second.last)
    return Until(At(late.agent, negated(second.body)), At(early.agent, first.body), 0, last)


def _prism(mission: Mission, corners: Bar) -> Shape:
    band = None if mission.dimension == 2 else Prism(mission.world.low[2], mission.world.high[2])
    return Polygon(corners, band)


def _bars(mission: Mission, part: StandingPart, path: Array, company: Array) -> list[Bar]:
    """Barriers across a path, from the part of an obstacle that it passes to another obstacle or the world's boundary.

    First the shortest of those that most of a group crosses, then the shortest of all. Barriers over starts or finishes
    are excluded.

    Args:
        path: positions of one agent, (steps + 1, 2), metres.
        company: positions of the group, (agents, steps + 1, 2), metres.
    """
    low, high = mission.world.low[:2], mission.world.high[:2]
    standing = [outline(mission, each.shape) for each in mission.obstacles if isinstance(each.motion, Still)]
    behind = shapely.union_all([shapely.box(*low, *high).exterior, *(each for each in standing)])
    far = float(np.hypot(high[0] - low[0], high[1] - low[1]))
    half = THICK * max(high[0] - low[0], high[1] - low[1]) / 2
    ends = shapely.union_all(
        [
            shapely.Point(place.point[:2]).buffer(agent.radius + mission.clearance)
            for agent in mission.agents
            for place in agent.ends
            if place.point is not None
        ]
    )
    ways = shapely.linestrings(company)
    found: list[tuple[int, float, int, shapely.Geometry]] = []
    places = path[np.unique(np.linspace(0, len(path) - 1, LOOKED_AT).astype(np.int64))]
    for number, place in enumerate(places if np.ptp(path, axis=0).any() else ()):
        begin = np.array(shapely.shortest_line(part.solid, shapely.Point(place)).coords[0])
        away = place - begin
        length = float(np.hypot(*away))
        if length <= 0:
            continue
        ray = shapely.LineString([begin + away / length * 1e-6, begin + away / length * far])
        hits = shapely.intersection(ray, behind)
        if hits.is_empty:
            continue
        reach = shapely.Point(begin).distance(hits) if part.solid.distance(hits) > 1e-5 else 0.0
        if reach <= length:
            continue  # another obstacle is in between
        bar = shapely.LineString([begin, begin + away / length * reach])
        if ends.is_empty or bar.distance(ends) > half:
            found.append((-int(shapely.intersects(ways, bar).sum()), bar.length, number, bar))
    if not found:
        return []
    chosen = [min(found, key=lambda each: each[:3])[-1], min(found, key=lambda each: each[1:3])[-1]]
    return list(dict.fromkeys(_corners(bar, half) for bar in chosen))


def _corners(bar: shapely.Geometry, half: float) -> Bar:
    wide = bar.buffer(half, cap_style="flat")
    return tuple((round(float(x), 6), round(float(y), 6)) for x, y in wide.exterior.coords[:-1])


def _leaves_ways(mission: Mission, barred: tuple[Bar, ...], position: Array) -> bool:
    """Return whether every agent can still reach the last position of its plan on a map with the barriers.

    Args:
        position: positions of the plan, (agents, steps + 1, dim), metres.
    """
    standing = [outline(mission, each.shape) for each in mission.obstacles if isinstance(each.motion, Still)]
    taken = shapely.union_all([*standing, *(shapely.Polygon(corners) for corners in barred)]).buffer(
        least_room(mission) * 0.99
    )
    world = shapely.box(*mission.world.low[:2], *mission.world.high[:2])
    pieces = shapely.get_parts(world.difference(taken))
    for path in position[..., :2]:
        ends = [shapely.Point(path[0]), shapely.Point(path[-1])]
        if not any(all(piece.distance(end) < 1e-6 for end in ends) for piece in pieces):
            return False
    return True
