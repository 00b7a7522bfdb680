"""Resolution of formations: every kind becomes distances or offsets between pairs of agents.

says MC013 MC014 MC105 MC205 MC206 MC207 MC209 MC210
"""

from __future__ import annotations

import math
from itertools import combinations, pairwise

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.units import Dimension, Metres
from missionc.frontend.resolve.context import REPORTED, Context
from missionc.frontend.resolve.resolve_agents import resolve_set
from missionc.frontend.resolve.resolve_quantities import excerpt, resolved_number, shown, whole
from missionc.frontend.resolve.resolve_settings import known_settings, missing, relation, said_twice, unknown_word
from missionc.frontend.resolve.resolve_shapes import padded, resolve_offset
from missionc.frontend.syntax import ast

SETTINGS: dict[str, tuple[str, ...]] = {
    "line": ("spacing", "heading"),
    "chain": ("spacing",),
    "circle": ("spacing", "radius"),
    "grid": ("spacing", "rows", "columns"),
    "star": ("spacing",),
    "offsets": (),
    "distances": (),
}
"""Names of the settings of each kind of formation, besides its tolerance."""


def resolve_formation(context: Context, formation: ast.Formation) -> ir.Formation:
    """Formation with its edges; without edges if a part of it is invalid, which is reported."""
    name, kind = formation.name.text, formation.kind.text
    agents = resolve_set(context, formation.agents).agents
    tolerance, edges = Metres(REPORTED), tuple[ir.FormationEdge, ...]()
    if kind in SETTINGS:
        known = (*SETTINGS[kind], "tolerance")
        settings = known_settings(context, formation.settings, known, f"`{kind}`")
        tolerance = Metres(_length(context, formation, settings, "tolerance"))
        edges = _edges(context, formation, settings, agents)
    else:
        unknown_word(context, formation.kind, tuple(SETTINGS), "`formation`", "kind")
    return ir.Formation(name, kind, agents, edges, tolerance, formation.total, formation.name.span)


def _edges(
    context: Context, formation: ast.Formation, settings: dict[str, ast.Setting], agents: tuple[int, ...]
) -> tuple[ir.FormationEdge, ...]:
    rigid = formation.kind.text in ("circle", "grid") or (formation.kind.text == "line" and "heading" not in settings)
    count = len(agents)
    if not _room(context, formation, count * (count - 1) // 2 if rigid else count):
        return ()
    match formation.kind.text:
        case "offsets":
            return _offsets(context, formation, agents)
        case "distances":
            return _distances(context, formation, agents)
        case "circle":
            return _circle(context, formation, settings, agents)
        case "chain":
            spacing = _length(context, formation, settings, "spacing")
            return tuple(ir.FormationEdge(a, b, spacing) for a, b in pairwise(agents))
        case "star":
            spacing = _length(context, formation, settings, "spacing")
            return tuple(ir.FormationEdge(agents[0], other, spacing) for other in agents[1:])
        case "grid":
            spacing = _length(context, formation, settings, "spacing")
            columns = _columns(context, formation, settings, len(agents))
            places = [divmod(place, columns) for place in range(len(agents))]
            return _apart(agents, [(spacing * row, spacing * column) for row, column in places])
        case _:
            return _line(context, formation, settings, agents)


def _line(
    context: Context, formation: ast.Formation, settings: dict[str, ast.Setting], agents: tuple[int, ...]
) -> tuple[ir.FormationEdge, ...]:
    """Edges of a rigid line: distances of all pairs, or with a heading the offset of each agent from the first."""
    spacing = _length(context, formation, settings, "spacing")
    if "heading" not in settings:
        return _apart(agents, [(spacing * place, 0.0) for place in range(len(agents))])
    relation(context, settings["heading"], "", "=")
    heading = _heading(context, settings["heading"].high)
    along = padded(context, (spacing * math.cos(heading), spacing * math.sin(heading)))
    return tuple(
        ir.FormationEdge(agents[0], agent, tuple(place * value for value in along))
        for place, agent in enumerate(agents[1:], start=1)
    )


def _heading(context: Context, quantity: ast.Quantity) -> float:
    """Heading in radians from the first axis.

    A number beyond a full turn is probably degrees without their unit, and is reported.
    """
    heading = resolved_number(context, quantity, Dimension.ANGLE, "the heading")
    if abs(heading) <= 2 * math.pi:
        return heading
    if not math.isnan(heading):
        bare = isinstance(quantity, ast.Number) and quantity.unit is None
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the heading is {shown(heading)} rad, more than a full turn",
            quantity.span,
            help=f"write `{excerpt(quantity.span)} deg`" if bare else "write an angle of at most one turn",
            fix=Fix(quantity.span, f"{quantity.span.text} deg") if bare else None,
        )
    return REPORTED


def _circle(
    context: Context, formation: ast.Formation, settings: dict[str, ast.Setting], agents: tuple[int, ...]
) -> tuple[ir.FormationEdge, ...]:
    """Edges of a regular polygon, by its radius or by the distance of adjacent agents."""
    count = max(len(agents), 2)
    if "radius" in settings and "spacing" in settings:
        said_twice(context, "the size of the circle", settings["spacing"].span, settings["radius"].span)
    if "radius" in settings:
        radius = _length(context, formation, settings, "radius")
    else:
        radius = _length(context, formation, settings, "spacing") / (2 * math.sin(math.pi / count))
    turn = 2 * math.pi / count
    return _apart(
        agents,
        [(radius * math.cos(turn * place), radius * math.sin(turn * place)) for place in range(len(agents))],
    )


def _columns(context: Context, formation: ast.Formation, settings: dict[str, ast.Setting], count: int) -> int:
    """Number of columns of a grid formation: as given, from the given rows, or as square as possible."""
    given = {
        word: whole(context, settings[word].high, f"the number of {word}", least=1)
        for word in ("rows", "columns")
        if word in settings
    }
    for word in given:
        relation(context, settings[word], "", "=")
    if any(map(math.isnan, given.values())):
        return 1
    rows, columns = given.get("rows"), given.get("columns")
    if rows is not None and columns is not None and rows * columns < count:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{shown(rows)} rows of {shown(columns)} have {shown(rows * columns)} positions for {count} agents",
            formation.span,
            help="delete `rows` or `columns`",
        )
    if columns is None:
        columns = math.ceil(count / rows) if rows is not None else math.ceil(math.sqrt(count))
    return max(int(columns), 1)


def _room(context: Context, formation: ast.Formation, count: int) -> bool:
    """Return whether the mission's formations may have ``count`` more edges; the first excess is reported."""
    limit = context.limits.formation_edges
    before = context.edges
    context.edges += count
    if before <= limit < context.edges:
        context.report(
            code.TOO_LARGE_TO_EXPAND,
            f"formations up to `{formation.name.text}` have {context.edges} edges; the limit is {limit}",
            formation.span,
            help="raise the limit with `--limit formation_edges=VALUE`",
        )
    return context.edges <= limit


def _apart(agents: tuple[int, ...], places: list[tuple[float, float]]) -> tuple[ir.FormationEdge, ...]:
    """Edges between all pairs of agents, with the distances of the given positions."""
    return tuple(
        ir.FormationEdge(a, b, math.dist(here, there))
        for (a, here), (b, there) in combinations(zip(agents, places, strict=True), 2)
    )


# ----------------------------------------------------- offsets and distances


def _offsets(context: Context, formation: ast.Formation, agents: tuple[int, ...]) -> tuple[ir.FormationEdge, ...]:
    """Edges with the offset of each agent from the first, independent of the pose of the formation."""
    written = () if isinstance(formation.offsets, ast.File) else formation.offsets
    offsets = [resolve_offset(context, point.coordinates, point.span) for point in written]
    if not agents or isinstance(formation.offsets, ast.File):
        return ()
    if len(offsets) != len(agents):
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"`{formation.name.text}` has {len(agents)} agents and {len(offsets)} offsets",
            formation.span,
            help="give one offset for each agent",
        )
        return ()
    if len({len(offset) for offset in offsets}) > 1:
        return ()
    return tuple(
        ir.FormationEdge(agents[0], agent, tuple(b - a for a, b in zip(offsets[0], offset, strict=True)))
        for agent, offset in zip(agents[1:], offsets[1:], strict=True)
    )


def _distances(context: Context, formation: ast.Formation, agents: tuple[int, ...]) -> tuple[ir.FormationEdge, ...]:
    """Edges between the listed pairs of agents, at the listed distances."""
    edges: list[ir.FormationEdge] = []
    first: dict[frozenset[float], ast.Link] = {}
    if not formation.links:
        missing(
            context,
            f"the distances of `{formation.name.text}`",
            formation.span,
            "list the distances, for example `(0-1: 0.8 m)`",
        )
    for link in formation.links:
        places = [_place(context, formation, item, len(agents)) for item in (link.first, link.second)]
        distance = resolved_number(context, link.distance, Dimension.LENGTH, "the distance", above=0)
        pair = frozenset(places)
        if any(map(math.isnan, places)):
            continue
        if len(pair) == 1:
            _to_itself(context, link)
        elif pair in first:
            said_twice(context, "the distance of these two agents", link.span, first[pair].span)
        else:
            first[pair] = link
            edges.append(ir.FormationEdge(agents[int(places[0])], agents[int(places[1])], distance))
    return tuple(edges)


def _place(context: Context, formation: ast.Formation, item: ast.Quantity, count: int) -> float:
    """Index among the formation's agents; NaN if it is invalid, which is reported, or while the agents are unknown."""
    place = whole(context, item, "the place")
    if not count or place < count:
        return place if count else REPORTED
    if not math.isnan(place):
        context.report(
            code.NO_SUCH_MEMBER,
            f"no agent has the number {shown(place)}: `{formation.name.text}` has agents 0 to {count - 1}",
            item.span,
            labels=(Label(formation.agents.span, "agents of the formation"),),
            help=f"write a number from 0 to {count - 1}",
        )
    return REPORTED


# ------------------------------------------------------------------ settings


def _length(context: Context, formation: ast.Formation, settings: dict[str, ast.Setting], word: str) -> float:
    """Length that a setting gives, above 0; NaN if it is missing, which is reported."""
    name = formation.name.text
    setting = settings.get(word)
    if setting is None:
        missing(context, f"the {word} of `{name}`", formation.span, f"add `{word} VALUE`, in metres")
        return REPORTED
    relation(context, setting, "", "=")
    return resolved_number(context, setting.high, Dimension.LENGTH, f"the {word} of `{name}`", above=0)


def _to_itself(context: Context, link: ast.Link) -> None:
    context.report(
        code.VALUE_OUT_OF_RANGE,
        "the distance of an agent to itself is always 0",
        link.span,
        help="name two different agents",
    )
