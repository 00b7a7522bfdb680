"""Space for formations: tests whether a formation fits in the world around static obstacles, and through its
passages.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, TypeAlias

from missionc.frontend.checks.free_space import FreeSpace
from missionc.geometry import plain_floats
from missionc.geometry.configuration_space import FRACTIONS, SURE, Area, common
from missionc.geometry.plain_floats import Place
from missionc.ir import Formation, Mission, Still
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.wording import metres

if TYPE_CHECKING:
    from missionc.geometry.formation_placements import Spot

Layout: TypeAlias = dict[int, tuple[float, ...]]
"""Position of each agent relative to the first, metres."""

ROUNDING = 1e-9

HEADINGS = 8
"""Number of headings that are tried to place a formation, without numpy."""


def no_room(ground: FreeSpace, formation: Formation, *, suspecting: bool) -> str | None:
    """Reason why a formation fits nowhere in the world; None if it may fit.

    Args:
        suspecting: only try to prove that it fits, and return an empty reason if that fails.
    """
    mission = ground.mission
    if not formation.edges:
        return None
    layout = _layout(mission, formation)
    if layout is not None and _placed(mission, formation, layout):
        return None
    if suspecting:
        return ""
    if (figure := _too_long(mission, formation)) is not None:
        return figure
    if mission.dimension != 2:
        return None
    return None if not _places(ground, formation, first=True).is_empty else _has_no_place(mission, layout)


def parted(
    ground: FreeSpace,
    formation: Formation,
    start: Mapping[int, Area],
    goal: Mapping[int, Area],
    grown: float,
) -> str | None:
    """Reason why agents in a formation cannot get from a start to a goal; None if they may.

    Only formations with a fixed heading are tested: for one that turns, bounds over all headings exclude almost
    nothing.

    Args:
        start, goal: area of each agent.
        grown: distance in metres from the goal that is allowed.
    """
    mission = ground.mission
    turns = not formation.edges or not isinstance(formation.edges[0].target, tuple)
    if mission.dimension != 2 or turns or not ground.ways.shapes:
        return None
    from missionc.geometry.formation_placements import joined_placements
    from missionc.geometry.geodesic_bounds import widest_passage

    order, spots = _spots(mission, formation)
    places = _places(ground, formation, first=False)
    ends = []
    for sets, more in ((start, 0.0), (goal, grown)):
        here = places
        for agent, spot in zip(order, spots, strict=True):
            if agent in sets:
                far = more + spot.slack + max(math.hypot(*point) for point in spot.points)
                here = here.intersection(_flat(ground, ground.atlas.grown(sets[agent], far, outer=True)))
        ends.append(here)
    if any(end.is_empty for end in ends) or places.is_empty:
        return None  # not a matter of passages
    first = mission.agents[order[0]]
    stride = first.dynamics.top_speed * mission.step * (1 + ROUNDING) + ROUNDING
    if joined_placements(places, stride, ends):
        return None
    bodies = 2 * min(mission.agents[agent].radius for agent in formation.agents)
    points = [spot.points[0] for spot in spots]
    low, high = mission.world.low, mission.world.high
    most = max(b - a for a, b in zip(low, high, strict=True)) / 2
    standing, world = _flat(ground, ground.standing), _flat(ground, ground.atlas.whole())
    width = 2 * widest_passage(standing, most, world, *ends)
    size = f"{metres(_length(points) + bodies)} long with a fixed heading"
    return f"{size}; the widest passage is {metres(width)} wide"


def _flat(ground: FreeSpace, area: Area) -> Any:
    return common(area, ground.atlas.whole()).geometry()[0]


def _places(ground: FreeSpace, formation: Formation, *, first: bool) -> Any:
    """Outer bound on the positions of a formation's first agent, as a plane geometry."""
    from missionc.geometry.formation_placements import placements  # with shapely, if no place has been found

    mission = ground.mission
    order, spots = _spots(mission, formation)
    free = [ground.free(mission.agents[agent].radius).geometry()[0] for agent in order]
    return placements(free, spots, turns=not isinstance(formation.edges[0].target, tuple), first=first)


# ------------------------------------------------------- bounds on the layout


def _spots(mission: Mission, formation: Formation) -> tuple[list[int], list[Spot]]:
    """Agents of a formation, its base first, and outer bounds on their positions relative to the base."""
    if isinstance(formation.edges[0].target, tuple):
        return _offsets(formation)
    return _about_longest(formation)


def _offsets(formation: Formation) -> tuple[list[int], list[Spot]]:
    """Agents of a formation, and their offsets from the first agent, each within the tolerance."""
    from missionc.geometry.formation_placements import Spot

    order, spots = [formation.edges[0].first], [Spot(((0.0, 0.0),), 0.0)]
    for edge in formation.edges:
        assert isinstance(edge.target, tuple)
        if edge.first == order[0]:
            order.append(edge.second)
            spots.append(Spot(((edge.target[0], edge.target[1]),), formation.tolerance))
    return order, spots


def _about_longest(formation: Formation) -> tuple[list[int], list[Spot]]:
    """Agents with edges to both ends of the longest edge, and their positions relative to one end, along the edge.

    An agent with an edge to one end only is included if that edge bounds it. By the law of cosines an agent at
    distances ``r`` and ``s`` from the ends of an edge of length ``d`` is ``(r² - s² + d²) / 2d`` along it; each with
    the range that the tolerance allows.
    """
    from missionc.geometry.formation_placements import Spot

    lengths = {frozenset((edge.first, edge.second)): _target(edge.target) for edge in formation.edges}
    base = max(formation.edges, key=lambda edge: _target(edge.target))
    here, there = base.first, base.second
    slack = formation.tolerance
    least, most = max(_target(base.target) - slack, ROUNDING), _target(base.target) + slack
    order, spots = [here, there], [Spot(((0.0, 0.0),), 0.0), Spot((((least + most) / 2, 0.0),), (most - least) / 2)]
    for agent in formation.agents:
        near, far = lengths.get(frozenset((here, agent))), lengths.get(frozenset((there, agent)))
        if agent in order:
            continue
        if near is None:
            continue
        order.append(agent)
        if far is None:
            spots.append(Spot(((0.0, 0.0),), near + slack))
            continue
        from_here, from_there = _interval(near, slack), _interval(far, slack)
        corners = [
            (r * r - s * s + d * d) / (2 * d)
            for r, s, d in product(from_here, from_there, (least, most, *_between(from_here, from_there, least, most)))
        ]
        along = min(corners), max(corners)
        closest = 0.0 if along[0] <= 0 <= along[1] else min(map(abs, along))
        upper = math.sqrt(max(from_here[1] ** 2 - closest**2, 0.0))
        lower = math.sqrt(max(from_here[0] ** 2 - max(map(abs, along)) ** 2, 0.0))
        middle = ((along[0] + along[1]) / 2, (lower + upper) / 2)
        reach = math.hypot((along[1] - along[0]) / 2, (upper - lower) / 2)
        spots.append(Spot((middle, (middle[0], -middle[1])), reach))
    return order, spots


def _between(here: tuple[float, float], there: tuple[float, float], least: float, most: float) -> Iterator[float]:
    """Yield lengths of the edge within its range at which an agent is nearest along it: where r² - s² is their
    square.
    """
    for r, s in product(here, there):
        square = r * r - s * s
        if square > 0 and least < math.sqrt(square) < most:
            yield math.sqrt(square)


def _interval(length: float, slack: float) -> tuple[float, float]:
    return max(length - slack, 0.0), length + slack


def _target(target: float | Sequence[float]) -> float:
    return target if isinstance(target, float | int) else math.hypot(*target)


# ----------------------------------------------------------- one place for it


def _layout(mission: Mission, formation: Formation) -> Layout | None:
    """Positions with every edge at its length, found agent by agent; None if none were found."""
    if isinstance(formation.edges[0].target, tuple):
        layout: Layout = {formation.edges[0].first: (0.0,) * mission.dimension}
        for edge in formation.edges:
            assert isinstance(edge.target, tuple)
            layout[edge.second] = tuple(
                a + b for a, b in zip(layout.get(edge.first, (0.0,) * mission.dimension), edge.target, strict=True)
            )
        return layout
    if mission.dimension != 2:
        return None
    lengths = {frozenset((edge.first, edge.second)): _target(edge.target) for edge in formation.edges}
    layout = {}
    for agent in formation.agents:
        known = [
            (other, lengths[frozenset((other, agent))]) for other in layout if frozenset((other, agent)) in lengths
        ]
        place = next((each for each in _candidates(layout, known) if _fits(layout, known, each)), None)
        if place is None:
            return None
        layout[agent] = place
    return layout


def _candidates(layout: Layout, known: Sequence[tuple[int, float]]) -> Iterator[tuple[float, float]]:
    """Yield positions at the right distance from the first two known neighbours of an agent, metres."""
    if not known:
        yield (0.0, 0.0)
        return
    (first, near), *others = known
    x, y = layout[first][0], layout[first][1]
    if not others:
        yield (x + near, y)
        return
    for other, far in others:
        across, up = layout[other][0] - x, layout[other][1] - y
        length = math.hypot(across, up)
        if length > 0:
            along = (near * near - far * far + length * length) / (2 * length)
            height = math.sqrt(max(near * near - along * along, 0.0))
            for side in (height, -height):
                yield (
                    x + (along * across - side * up) / length,
                    y + (along * up + side * across) / length,
                )


def _fits(layout: Layout, known: Sequence[tuple[int, float]], place: tuple[float, float]) -> bool:
    return all(abs(math.dist(layout[other], place) - length) <= SURE for other, length in known)


def _placed(mission: Mission, formation: Formation, layout: Layout) -> bool:
    """Return whether the layout fits somewhere in the world with every agent certainly clear of obstacles and other
    agents.
    """
    standing = [each.shape for each in mission.obstacles if isinstance(each.motion, Still)]
    fixed = isinstance(formation.edges[0].target, tuple) or mission.dimension != 2
    for number in range(1 if fixed else HEADINGS):
        turned = layout if fixed else _turned(layout, math.pi * number / HEADINGS)
        low = [min(place[axis] for place in turned.values()) for axis in range(mission.dimension)]
        high = [max(place[axis] for place in turned.values()) for axis in range(mission.dimension)]
        sides = list(zip(mission.world.low, mission.world.high, low, high, strict=True))
        for fractions in product((0.5, 0.02, 0.98, *FRACTIONS[1:3]), repeat=mission.dimension):
            by = [a - c + part * ((b - a) - (d - c)) for part, (a, b, c, d) in zip(fractions, sides, strict=True)]
            if any(b - a < d - c for a, b, c, d in sides):
                break
            if all(
                _clear(mission, standing, agent, tuple(map(sum, zip(place, by, strict=True))))
                for agent, place in turned.items()
            ):
                return True
    return False


def _turned(layout: Layout, heading: float) -> Layout:
    along, across = math.cos(heading), math.sin(heading)
    return {agent: (along * x - across * y, across * x + along * y) for agent, (x, y) in layout.items()}


def _clear(mission: Mission, standing: Sequence[Any], agent: int, place: tuple[float, ...]) -> bool:
    room = mission.agents[agent].radius + mission.clearance
    return all(signed_distance(plain_floats, shape, Place(place)) > room + SURE for shape in standing)


# ------------------------------------------------------------------ messages


def _too_long(mission: Mission, formation: Formation) -> str | None:
    """Text about an edge that is longer than the world, even with its tolerance; None if there is none."""
    sides = [high - low for low, high in zip(mission.world.low, mission.world.high, strict=True)]
    for edge in formation.edges:
        if isinstance(edge.target, tuple):
            for far, side, axis in zip(edge.target, sides, "xyz", strict=False):
                least = abs(far) - formation.tolerance
                if least > side + ROUNDING:
                    return f"at least {metres(least)} long along {axis}; the world is {metres(side)} long"
        elif edge.target - formation.tolerance > math.hypot(*sides) + ROUNDING:
            least = edge.target - formation.tolerance
            return f"at least {metres(least)} long; the diagonal of the world is {metres(math.hypot(*sides))}"
    return None


def _has_no_place(mission: Mission, layout: Layout | None) -> str:
    if layout is None:
        return "no collision-free position and heading"
    from missionc.geometry.formation_placements import least_width

    points = [(place[0], place[1]) for place in layout.values()]
    size = f"{metres(_length(points))} long and {metres(least_width(points))} wide between centres"
    return f"{size}: no collision-free position"


def _length(points: Sequence[tuple[float, float]]) -> float:
    return max((math.dist(here, there) for here in points for there in points), default=0.0)
