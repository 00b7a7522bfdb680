"""Missions rebuilt in Python: each node of a syntax tree by the operator or the method that builds it."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from typing import Any

from missionc.frontend.builder import functions, items, parts
from missionc.frontend.builder.mission import Mission
from missionc.frontend.syntax import ast
from missionc.frontend.syntax import show_tree as show
from missionc.ir.language.predicates import PREDICATES

SIGNS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "<=": operator.le,
    "<": operator.lt,
    ">=": operator.ge,
    ">": operator.gt,
    "=": operator.eq,
    "and": operator.and_,
    "or": operator.or_,
    "implies": operator.rshift,
}


def quantity(node: Any) -> parts.Quantity:
    match node:
        case ast.Number(_, value, None):
            return parts.quantity(value)
        case ast.Indexed(_, text, indices):
            return parts.quantity(text)[tuple(map(quantity, indices))]
        case ast.Negative(_, body):
            return -quantity(body)
        case ast.Arithmetic(_, sign, left, right):
            made: parts.Quantity = SIGNS[sign](quantity(left), quantity(right))
            return made
        case ast.Extreme(_, word, values):
            return {"min": functions.minimum, "max": functions.maximum}[word](*map(quantity, values))
        case ast.Distance(_, ends):
            return functions.distance(*map(agents, ends))
        case _:
            return parts.quantity(show.loose(node))


def agents(node: Any) -> parts.Agents:
    match node:
        case ast.Indexed(_, text, indices) if len(indices) > 1:
            return parts.agents(text)[tuple(map(quantity, indices))]
        case ast.Member(_, team, low, None):
            return agents(team)[quantity(low)] if not isinstance(team, ast.Indexed) else parts.agents(show.agents(node))
        case ast.Member(_, ast.Name() as team, low, ast.Number(_, high, None)) if not isinstance(team, ast.Indexed):
            return agents(team)[quantity(low) : int(high) + 1]
        case _:
            return parts.agents(show.agents(node))


def formula(node: Any) -> parts.Formula:
    match node:
        case ast.Truth(_, value):
            return parts.formula(value)
        case ast.Call(_, name, arguments) if name.text in {each.name for each in PREDICATES if each.called}:
            called: parts.Formula = getattr(functions, name.text)(*map(_argument, arguments))
            return called
        case ast.Compare(_, sign, left, right):
            compared: parts.Formula = SIGNS[sign](quantity(left), quantity(right))
            return compared
        case ast.Facing(_, within, towards):
            return functions.heading(quantity(within), quantity(towards))
        case ast.Quantified(_, kind, number, who, body):
            quantify = getattr(agents(who), kind.replace(" ", "_"))
            made: parts.Formula = (
                quantify(formula(body)) if number is None else quantify(quantity(number), formula(body))
            )
            return made
        case ast.OneAgent(_, who, body):
            return agents(who).satisfies(formula(body))
        case ast.ForEach(_, kind, _, indices, body) if len({each.name.text for each in indices}) == len(indices):
            ranges = {each.name.text: (quantity(each.low), quantity(each.high)) for each in indices}
            whole = formula(body)
            return whole.for_each(**ranges) if kind == "every" else whole.for_some(**ranges)
        case ast.Apply():
            return _apply(node)
        case _:
            return parts.formula(show.formula(node))


def _argument(node: Any) -> Any:
    return agents(node) if isinstance(node, ast.Name | ast.Member) else quantity(node)


def _apply(node: ast.Apply) -> parts.Formula:
    operands = [formula(each) for each in node.operands]
    if node.operator in SIGNS:
        made: parts.Formula = reduce(SIGNS[node.operator], operands)
        return made
    if node.operator == "not":
        return ~operands[0]
    first, *others = operands
    applied = getattr(parts.Formula, node.operator)(first, *others, *_bounds(node.bounds), **_length(node.bounds))
    if node.comparison is not None and node.number is not None:
        applied = SIGNS[node.comparison](applied, quantity(node.number))
    assert isinstance(applied, parts.Formula)
    return applied


def _bounds(node: Any) -> list[Any]:
    match node:
        case ast.Window(_, low, high):
            return [quantity(low), "end" if high is None else quantity(high)]
        case ast.Period(_, length):
            return [quantity(length)]
        case _:
            return []


def _length(node: Any) -> dict[str, Any]:
    if not isinstance(node, ast.Length):
        return {}
    low, high = (None if end is None else quantity(end) for end in (node.low, node.high))
    on = None if node.graph is None else show.named(node.graph)
    return {node.word: high if low is None else (low, high), "on": on}


def shape(node: Any) -> parts.Shape:
    match node:
        case ast.Combined(_, sign, left, right):
            made: parts.Shape = SIGNS[sign](shape(left), shape(right))
            return made
        case ast.Box(_, low, high, height):
            return functions.box(point(low), point(high), _height(height))
        case ast.Disc(_, centre, radius, height):
            return functions.disc(point(centre), quantity(radius), _height(height))
        case ast.Ball(_, centre, radius):
            return functions.ball(point(centre), quantity(radius))
        case ast.Cylinder(_, centre, radius, height):
            return functions.cylinder(point(centre), quantity(radius), (quantity(height.low), quantity(height.high)))
        case ast.Polygon(_, corners, height):
            return functions.polygon(*map(point, corners), height=_height(height))
        case _:
            return parts.shape(show.shape_text(node))


def point(node: ast.Point) -> list[parts.Quantity]:
    return list(map(quantity, node.coordinates))


def _height(node: ast.Height | None) -> Any:
    return None if node is None else (quantity(node.low), quantity(node.high))


def declare(mission: Mission, node: ast.Declaration) -> None:
    """Add a declaration by the method of its kind, or as text if there is no such method."""
    match node:
        case ast.Param(_, name, value):
            mission.param(show.named(name), quantity(value))
        case ast.Include(_, path):
            mission.include(path)
        case ast.Time(_, step, horizon):
            mission.time(quantity(step), quantity(horizon))
        case ast.World(_, low, high):
            mission.world(point(low), point(high))
        case ast.Region(_, name, area):
            mission.region(show.named(name), shape(area))
        case ast.Obstacle(
            _, name, area, ast.Along() | ast.AlongFile() | ast.Moving(_, _, None) | None as motion, growth
        ):
            mission.obstacle(
                show.named(name),
                shape(area),
                moving=point(motion.velocity) if isinstance(motion, ast.Moving) else None,
                along=_along(motion),
                uncertain=None if growth is None else quantity(growth),
            )
        case ast.Beacon(_, name, position):
            mission.beacon(show.named(name), point(position))
        case ast.Team(_, name, size, listed) if [_word(each) for each in listed] == in_order(listed):
            given = {_word(each): _item(each) for each in listed}
            if size is None:
                mission.agent(show.named(name), **given)
            else:
                mission.team(show.named(name), quantity(size), **given)
        case ast.Group(_, name, members):
            mission.group(show.named(name), *map(agents, members))
        case ast.Graph(_, name, kind, radius, over) if len({each.name.text for each in node.weights}) == len(
            node.weights
        ):
            mission.graph(
                show.named(name),
                kind,
                None if radius is None else quantity(radius),
                over=None if over is None else agents(over),
                pairs=_pairs(node.ranges),
                weights={each.name.text: (quantity(each.value), _pairs(each.pairs)) for each in node.weights},
            )
        case ast.Separation(_, distance):
            mission.separation(quantity(distance))
        case ast.Clearance(_, distance):
            mission.clearance(quantity(distance))
        case ast.Let(_, name, body):
            mission.let(show.named(name), formula(body))
        case ast.Require(_, label, body):
            mission.require(formula(body), None if label is None else show.named(label))
        case ast.Prefer(_, label, body, weight):
            named = None if label is None else show.named(label)
            mission.prefer(formula(body), named, weight=None if weight is None else quantity(weight))
        case ast.Tolerate(_, delay, who):
            mission.tolerate_delay(quantity(delay), agents(who))
        case ast.Maximize(_, goal):
            mission.maximize(goal.text)
        case ast.Minimize(_, goal):
            mission.minimize(goal.text)
        case ast.Solve(_, backend, settings, files) if len({each.name.text for each in settings}) == len(settings):
            given = {each.name.text: quantity(each.high) for each in settings}
            mission.solve(backend.text, **given, **{each.name.text: each.path for each in files})
        case _:
            mission.add(show.show(ast.Program(node.span, (node,))))


def _along(motion: Any) -> Any:
    match motion:
        case ast.AlongFile(_, file):
            return file.path
        case ast.Along(_, waypoints):
            return [tuple(map(quantity, (each.time, *each.offset))) for each in waypoints]
        case _:
            return None


def _pairs(pairs: tuple[ast.OfPair, ...]) -> dict[Any, Any]:
    return {(agents(each.senders), agents(each.receivers)): quantity(each.value) for each in pairs}


ORDER = ("radius", "altitude", "dynamics", "start", "finish", "vehicle", "flight", "yaw")
"""Order of the items of a team in the text."""


def in_order(items: tuple[ast.TeamItem, ...]) -> list[str]:
    """Words of items in the order of ``Mission``, each once; dynamics and start are always present."""
    words = {_word(each) for each in items} | {"dynamics", "start"}
    return [word for word in ORDER if word in words]


def ordered(node: ast.Declaration) -> ast.Declaration:
    """Declaration with the items of a team in that order."""
    if not isinstance(node, ast.Team) or not {_word(each) for each in node.items} <= set(ORDER):
        return node
    return replace(node, items=tuple(sorted(node.items, key=lambda item: ORDER.index(_word(item)))))


def _word(item: ast.TeamItem) -> str:
    return item.name.text if isinstance(item, ast.Setting) else type(item).__name__.lower()


def _item(item: ast.TeamItem) -> Any:
    match item:
        case ast.Setting(_, _, "", value):
            return quantity(value)
        case ast.Start(_, ast.InRegion(_, region)) | ast.Finish(_, ast.InRegion(_, region)):
            return parts.region(show.named(region))
        case ast.Start(_, ast.AtPoints(_, places)) | ast.Finish(_, ast.AtPoints(_, places)):
            return list(map(point, places))
        case ast.Dynamics(_, name, settings) if settings and all(each.relation != "" for each in settings):
            return getattr(items, name.text)(**_settings(settings))
        case ast.Vehicle(_, name, settings):
            return name.text, _settings(settings)
        case ast.Flight(_, listed) if all(isinstance(each, ast.Setting) for each in listed):
            return _settings(listed) or True
        case ast.Yaw(_, angle) if angle is not None:
            return quantity(angle)
        case _:
            return show.item_text(item).partition(" ")[2]


def _settings(settings: Any) -> dict[str, Any]:
    return {
        each.name.text: quantity(each.high) if each.low is None else (quantity(each.low), quantity(each.high))
        for each in settings
    }


def rebuilt(program: ast.Program) -> Mission:
    """Mission of a program, declaration by declaration; its name comes first."""
    name = next(each.name.text for each in program.declarations if isinstance(each, ast.MissionName))
    mission = Mission(name)
    for each in program.declarations:
        if not isinstance(each, ast.MissionName):
            declare(mission, each)
    return mission
