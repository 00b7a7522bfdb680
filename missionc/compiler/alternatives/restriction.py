"""Restrictions that forbid what a plan decided: a branch of a choice, an order, a side on which it passes what stands.

    in   Mission, Kernel, what is forbidden
    out  a Mission and a Kernel of which every plan is one of the mission, and has decided otherwise

Any backend plans what is restricted: a choice loses branches, an order becomes a requirement, and where nobody is to
pass there is an obstacle. What it says that is impossible is so of the restricted mission alone.

Source:
    Murty 1968, Lawler 1972, the k best solutions by partitioning what the best one left open.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
import shapely

from missionc.base.trace import Array
from missionc.geometry.winding import StandingPart, least_room, outline
from missionc.ir import Mission, Obstacle, Polygon, Prism, Shape, Still
from missionc.ir.kernel.choices import ChoicePoint, branches, without, witnesses
from missionc.ir.kernel.nodes import All, At, Goal, Kernel, Node, Until
from missionc.ir.kernel.normal_form import negated
from missionc.verification.monitoring.signature import Event, Signature

BARRED = "barred"
"""The name of what is an obstacle in planning alone; no identifier, so that no mission has it."""

THICK = 1 / 150
"""How thick it is, as a share of the world's longer side."""

PASSING = np.pi / 3
"""Radians that an agent sweeps about what it passes, at least."""

LOOKED_AT = 24
"""Places of a path from which what bars it is tried."""

MOST_ORDERS = 24
"""Orders of a plan that are reversed, each by itself."""

Bar: TypeAlias = tuple[tuple[float, float], ...]
"""Corners of what nobody may pass, metres."""


@dataclass(frozen=True, slots=True)
class Restriction:
    """What is forbidden.

    Args:
        removed: the numbers of the branches that a choice does without.
        first: what has to hold before something else does: pairs, the one that comes first before the other.
        barred: corners of what nobody may pass.
    """

    removed: dict[ChoicePoint, frozenset[int]] = field(default_factory=dict)
    first: tuple[tuple[Event, Event], ...] = ()
    barred: tuple[Bar, ...] = ()

    @property
    def key(self) -> Hashable:
        """The same for restrictions that forbid the same."""
        pairs = frozenset((one.asked, other.asked) for one, other in self.first)
        return frozenset(self.removed.items()), pairs, frozenset(self.barred)

    def applied(self, mission: Mission, kernel: Kernel) -> tuple[Mission, Kernel]:
        """The restricted mission."""
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
    """Restrictions that each forbid one thing that a plan decided, on top of those that it was planned with.

    Options, orders and sides in turns, so that a few tries see some of each.

    Args:
        position: of the plan, (agents, steps + 1, dim), metres.
        sides: whether sides are forbidden too.
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
    """Bars that a whole company has to go round come first, and the shortest ones after them."""
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
    """Formula that the first holds at a step at which both are asked for, and the second at no step before it."""
    early, late = first.asked, second.asked
    last = min(first.last, second.last)
    return Until(At(late.agent, negated(second.body)), At(early.agent, first.body), 0, last)


def _prism(mission: Mission, corners: Bar) -> Shape:
    band = None if mission.dimension == 2 else Prism(mission.world.low[2], mission.world.high[2])
    return Polygon(corners, band)


def _bars(mission: Mission, part: StandingPart, path: Array, company: Array) -> list[Bar]:
    """Bars across a path, (steps + 1, 2), from the part it passes to whatever stands behind it, or the world's border.

    The one that the most of a company, (agents, steps + 1, 2), cross, and of such the shortest; and, where that is
    another one, the shortest of all. None that does not leave all starts and finishes alone.
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
            continue  # something else stands between
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
    """Whether every agent can still get from where it starts to where a plan has it end, as far as a map shows."""
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
