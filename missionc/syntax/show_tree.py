"""Printer of the tree as canonical text: one declaration a line, operators by their words, no needless bracket.

``parse(show(program))`` is the same tree but for its spans.
"""

from __future__ import annotations

from typing import assert_never

from missionc.syntax import ast
from missionc.syntax.show_formula import agents, formula, loose, point, points, tight
from missionc.syntax.show_formula import name as named


def show(program: ast.Program) -> str:
    """The whole mission as text."""
    return "".join(_declaration(declaration) + "\n" for declaration in program.declarations)


def _declaration(node: ast.Declaration) -> str:
    match node:
        case ast.MissionName(_, name):
            return f"mission {name.text}"
        case ast.Param(_, name, value):
            return f"param {named(name)} = {loose(value)}"
        case ast.Include(_, path):
            return f'include "{path}"'
        case ast.Time(_, step, horizon):
            return f"time step {tight(step)}, horizon {tight(horizon)}"
        case ast.World(_, low, high):
            return f"world {point(low)} to {point(high)}"
        case ast.Region(_, name, shape):
            return f"region {named(name)} = {_shape(shape)}"
        case ast.Obstacle(_, name, shape, motion, growth):
            grows = "" if growth is None else f" uncertain {tight(growth)}"
            return f"obstacle {named(name)} = {_shape(shape)}{_motion(motion)}{grows}"
        case ast.Beacon(_, name, position):
            return f"beacon {named(name)} = {point(position)}"
        case ast.Team(_, name, size, items):
            head = f"agent {named(name)}" if size is None else f"team {named(name)}[{loose(size)}]"
            return "\n".join([head + " {", *(f"  {_item(item)}" for item in items), "}"])
        case ast.Group(_, name, members):
            return f"group {named(name)} = {', '.join(map(agents, members))}"
        case ast.Graph(_, name, kind):
            return f"graph {named(name)} = {kind}{_ranges(node)}"
        case ast.Formation():
            return _formation(node)
        case ast.Separation(_, length):
            return f"separation {tight(length)}"
        case ast.Clearance(_, length):
            return f"clearance {tight(length)}"
        case ast.Resource(_, name, of, rates):
            return f"resource {named(name)} of {agents(of)} {{ {', '.join(map(_rate, rates))} }}"
        case ast.Flag(_, name, of, marks):
            written = ", ".join(f"{mark.name.text} in {named(mark.within)}" for mark in marks)
            return f"flag {named(name)} of {agents(of)} {{ {written} }}"
        case ast.Let(_, name, body):
            return f"let {named(name)} = {formula(body)}"
        case ast.Require(_, label, body):
            return f"require {_labelled(label, body)}"
        case ast.Prefer(_, label, body, weight):
            return f"prefer {_labelled(label, body)}" + ("" if weight is None else f" weight {tight(weight)}")
        case ast.Tolerate(_, delay, who):
            return f"tolerate delay {tight(delay)} of {agents(who)}"
        case ast.Minimize(_, goal):
            return f"minimize {goal.text}"
        case ast.Solve(_, backend, settings, files):
            options = ", ".join([*map(_setting, settings), *(f'{each.name.text} = "{each.path}"' for each in files)])
            return f"solve with {backend.text}" + (f" {{ {options} }}" if options else "")
        case ast.FromFile():
            said = [*map(_setting, node.settings), *map(_file_option, node.options)]
            return " ".join([f'{node.kind} from "{node.file.path}"{"".join(map(_height, node.heights))}', *said])
        case _:
            assert_never(node)


def _file_option(node: ast.FileOption) -> str:
    match node.value:
        case ast.Point():
            return f"{node.word} {point(node.value)}"
        case words:
            return f"{node.word} " + ", ".join(f'"{each}"' if node.word == "layer" else each for each in words)


def _ranges(node: ast.Graph) -> str:
    radius = "" if node.radius is None else f" {tight(node.radius)}"
    over = "" if node.over is None else f" over {agents(node.over)}"
    weights = [f" weight {each.name.text} {tight(each.value)}{_of_pairs(each.pairs)}" for each in node.weights]
    return radius + over + _of_pairs(node.ranges) + "".join(weights)


def _of_pairs(pairs: tuple[ast.OfPair, ...]) -> str:
    written = ", ".join(f"{agents(p.senders)} to {agents(p.receivers)} {tight(p.value)}" for p in pairs)
    return f" {{ {written} }}" if written else ""


def _rate(node: ast.Rate) -> str:
    per = "" if node.unit is None else f" per {node.unit.text}"
    return f"{node.name.text} {tight(node.value)}{per}" + ("" if node.within is None else f" in {named(node.within)}")


def _labelled(label: ast.Name | None, body: ast.Formula) -> str:
    if label is not None:
        return f"{named(label)}: {formula(body)}"
    match body:
        case ast.OneAgent(_, ast.Name() as agent) if not isinstance(agent, ast.Indexed):
            return f"({formula(body)})"  # its agent would be read as the label
        case _:
            return formula(body)


# -------------------------------------------------------------------- shapes


def _shape(node: ast.Shape, binding: int = 0) -> str:
    match node:
        case ast.Name():
            return named(node)
        case ast.Box(_, low, high, height):
            return f"box {point(low)} to {point(high)}{_height(height)}"
        case ast.Disc(_, centre, radius, height):
            return f"disc at {point(centre)} radius {tight(radius)}{_height(height)}"
        case ast.Ball(_, centre, radius):
            return f"ball at {point(centre)} radius {tight(radius)}"
        case ast.Cylinder(_, centre, radius, height):
            return f"cylinder at {point(centre)} radius {tight(radius)}{_height(height)}"
        case ast.Polygon(_, corners, height):
            return f"polygon {points(corners)}{_height(height)}"
        case ast.Combined(_, operator, left, right):
            own = 2 if operator == "*" else 1
            text = f"{_shape(left, own)} {operator} {_shape(right, own + 1)}"
            return text if own >= binding else f"({text})"
        case _:
            assert_never(node)


def _height(node: ast.Height | None) -> str:
    return "" if node is None else f" height {tight(node.low)}..{tight(node.high)}"


def _motion(node: ast.Motion | None) -> str:
    match node:
        case None:
            return ""
        case ast.Moving(_, velocity, unit):
            return f" moving {point(velocity)}" + ("" if unit is None else f" {unit}")
        case ast.Along(_, waypoints):
            return " along " + ", ".join(
                f"({loose(waypoint.time)}: {', '.join(map(loose, waypoint.offset))})" for waypoint in waypoints
            )
        case ast.AlongFile(_, file):
            return f' along from "{file.path}"'
        case _:
            assert_never(node)


# -------------------------------------------------------------------- agents


def _item(node: ast.TeamItem) -> str:
    match node:
        case ast.Dynamics(_, name, settings):
            return f"dynamics {name.text}" + (f"({', '.join(map(_setting, settings))})" if settings else "")
        case ast.Start(_, places):
            return f"start {_places(places)}"
        case ast.Finish(_, places):
            return f"finish {_places(places)}"
        case ast.Vehicle(_, name, settings):
            return f"vehicle {name.text}" + (f" {{ {'  '.join(map(_setting, settings))} }}" if settings else "")
        case ast.Flight(_, items):
            parts = (f"pads {_places(item.places)}" if isinstance(item, ast.Pads) else _setting(item) for item in items)
            return "flight" + (f" {{ {'  '.join(parts)} }}" if items else "")
        case ast.Yaw(_, angle):
            return f"yaw {_yaw(angle)}"
        case ast.Setting():
            return _setting(node)
        case _:
            assert_never(node)


def _yaw(angle: ast.Quantity | None) -> str:
    match angle:
        case None:
            return "along path"
        case ast.Name(_, "along"):
            return "(along)"  # a parameter of that name
        case _:
            return tight(angle)


def _places(node: ast.Places) -> str:
    match node:
        case ast.InRegion(_, region):
            return f"in {named(region)}"
        case ast.AtPoints(_, at):
            return f"at {points(at)}"
        case ast.OnLine(_, first, last):
            return f"line {point(first)} to {point(last)}"
        case ast.OnGrid(_, low, high):
            return f"grid {point(low)} to {point(high)}"
        case ast.AtListed(_, file):
            return f'from "{file.path}"'
        case _:
            assert_never(node)


def _setting(node: ast.Setting) -> str:
    if node.low is not None:
        return f"{node.name.text} {tight(node.low)}..{tight(node.high)}"
    relation = f" {node.relation}" if node.relation else ""
    return f"{node.name.text}{relation} {tight(node.high)}"


def _formation(node: ast.Formation) -> str:
    parts = [f"formation {named(node.name)} = {node.kind.text} of {agents(node.agents)}"]
    if isinstance(node.offsets, ast.File):
        parts.append(f'from "{node.offsets.path}"')
    elif node.offsets:
        parts.append(points(node.offsets))
    if node.links:
        links = [
            f"{loose(ast.Arithmetic(link.span, '-', link.first, link.second))}: {loose(link.distance)}"
            for link in node.links
        ]
        parts.append(f"({', '.join(links)})")
    for setting in node.settings:
        total = "total " if node.total and setting.name.text == "tolerance" else ""
        parts.append(total + _setting(setting))
    return " ".join(parts)
