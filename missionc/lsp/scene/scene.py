"""The scene: what the map shows of a text, also of one that is half written.

in   a text, and the declarations of it that can be read
out  plain values for the page

Lengths are in metres. ``parts`` are outlines to be filled, as the report has them, with a point in them for
the name, ``inner``; ``pieces`` are what a drag edits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from missionc import ir
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.lsp.scene.pieces import Json, Pieces
from missionc.resolve.polygon_faults import Simple, fault
from missionc.resolve.resolve_places import Places, resolve_places
from missionc.resolve.resolve_points import known
from missionc.syntax import ast


def scene(source: Source, declarations: Sequence[ast.Declaration], limits: Limits) -> Json | None:
    """What there is to draw; nothing where there is no world to draw it in."""
    places = resolve_places(source, declarations, limits)
    if places is None:
        return None
    pieces = Pieces(source, places)
    return {
        "dimension": places.world.dimension,
        "low": list(places.world.low[:2]),
        "high": list(places.world.high[:2]),
        "things": [thing for item in places.declarations for thing in _things(pieces, places, item)],
    }


def _things(pieces: Pieces, places: Places, item: ast.Declaration) -> Iterator[Json]:
    match item:
        case ast.World():
            yield _thing(pieces, "world", "the world", item.span, list(pieces.world(item)))
        case ast.Region(name=name, shape=shape) if name.text in places.regions:
            drawn = _outline(places.world, places.regions[name.text].shape)
            yield {**_thing(pieces, "region", name.text, item.span, list(pieces.shape(shape))), **drawn}
        case ast.Obstacle(name=name, shape=shape) if name.text in places.obstacles:
            obstacle = places.obstacles[name.text]
            drawn = _outline(places.world, obstacle.shape)
            way = _way(obstacle.motion)
            pieced = list(pieces.shape(shape))
            yield {**_thing(pieces, "obstacle", name.text, item.span, pieced), **drawn, "way": way}
        case ast.Beacon(name=name, position=position):
            yield _thing(pieces, "beacon", name.text, item.span, list(pieces.point(position)))
        case ast.Team():
            yield from _team(pieces, places, item)
        case _:
            return


def _team(pieces: Pieces, places: Places, team: ast.Team) -> Iterator[Json]:
    """Where the agents of a team start and end: their bodies at single points, or the region that they are in."""
    agents = [agent for agent in places.agents if agent.team == team.name.text]
    for item in team.items:
        if not isinstance(item, ast.Start | ast.Finish):
            continue
        kind = "start" if isinstance(item, ast.Start) else "finish"
        at = [agent.start if kind == "start" else agent.finish for agent in agents]
        points = [list(place.point[:2]) for place in at if isinstance(place, ir.Exactly) and known(place.point)]
        pieced = list(pieces.team(item.places))
        region = item.places.region.text if isinstance(item.places, ast.InRegion) else ""
        if pieced or points or region:
            radius = agents[0].radius if agents and known((agents[0].radius,)) else 0.0
            thing = _thing(pieces, kind, team.name.text, item.span, pieced)
            yield {**thing, "agents": points, "radius": radius, "region": region, "count": len(agents)}


def _thing(pieces: Pieces, kind: str, name: str, span: Span, pieced: list[Json]) -> Json:
    return {"kind": kind, "name": name, "span": pieces.span(span), "pieces": pieced}


def _way(motion: ir.Still | ir.Path) -> list[list[float]]:
    """The offsets that a moving obstacle passes; none of one that stays."""
    if isinstance(motion, ir.Still) or not known(*motion.offsets):
        return []
    return [list(offset[:2]) for offset in motion.offsets]


def _outline(world: ir.World, shape: ir.Shape) -> Json:
    """The shape in parts, and a point in it for its name; nothing where it is no shape yet, as a crossed polygon."""
    from missionc.output.report.outlines import inner_point, solids  # by shapely, which is long to load

    parts = solids(world, shape) if _sound(shape) else []
    return {"parts": parts, "inner": inner_point(world, parts)} if parts else {"parts": []}


def _sound(shape: ir.Shape) -> bool:
    """Whether all its numbers are known, and each part of it has an area."""
    left = [shape]
    while left:
        match left.pop():
            case ir.Box(low, high):
                sound = known(low, high) and all(a < b for a, b in zip(low, high, strict=True))
            case ir.Disc(centre, radius) | ir.Ball(centre, radius):
                sound = known(centre, (radius,)) and radius > 0
            case ir.Polygon(corners):
                sound = known(*corners) and isinstance(fault(corners), Simple)
            case ir.Union(one, other) | ir.Intersection(one, other) | ir.Difference(one, other):
                left += [one, other]
                sound = True
        if not sound:
            return False
    return True
