"""Printer of the syntax tree as canonical text: declarations, formulas and quantities, without redundant brackets.

Each declaration has one line, and operators are words. ``parse(show(program))`` is the same tree except for its spans.
"""

from __future__ import annotations

from typing import assert_never

from missionc.frontend.syntax import ast

# Precedence of operators; an operand with a lower one than its place needs gets brackets.
_IFF, _IMPLIES, _OR, _AND, _PATH, _UNARY, _COUNTED = range(1, 8)
_CHAINS = {"and": _AND, "or": _OR}
_SUM, _PRODUCT, _FACTOR = range(1, 4)


def formula(node: ast.Formula, binding: int = _IFF, last: bool = True) -> str:
    """Text of a formula, in brackets if the context with precedence ``binding`` needs them.

    Args:
        last: True if nothing follows within the same brackets: only there may a quantifier have no brackets, because
            its body extends as far right as possible.
    """
    match node:
        case ast.Truth(_, value):
            return "true" if value else "false"
        case ast.Name() | ast.Member():
            return agents(node)
        case ast.Call(_, called, arguments):
            return f"{called.text}({', '.join(map(_argument, arguments))})"
        case ast.Compare(_, operator, left, right):
            return _in_brackets(f"{_sum(left)} {operator} {_sum(right)}", binding > _UNARY)
        case ast.Facing(_, within, towards):
            return _in_brackets(f"heading within {tight(within)} of {tight(towards)}", binding > _UNARY)
        case ast.Quantified(_, kind, number, who, body):
            least = "" if number is None else f" {tight(number)}"
            return _in_brackets(f"{kind}{least} {agents(who)}: {formula(body)}", not last)
        case ast.OneAgent(_, who, body):
            return _in_brackets(f"{agents(who)}: {formula(body)}", not last)
        case ast.ForEach(_, kind, _, indices, body):
            some = "some " if kind == "some" else ""
            return _in_brackets(f"for {some}{_indices(indices)}: {formula(body)}", not last)
        case ast.Apply():
            return _apply(node, binding, last)
        case _:
            assert_never(node)


def _argument(node: ast.Quantity | ast.Member) -> str:
    return agents(node) if isinstance(node, ast.Name | ast.Member) else loose(node)


def _apply(node: ast.Apply, binding: int, last: bool) -> str:
    word = node.operator + _bounds(node.bounds)
    match node.operands:
        case (body,) if isinstance(node.bounds, ast.Period):
            return _in_brackets(f"{word}: {formula(body)}", not last)
        case (body,) if node.number is not None:
            text = f"{word} {formula(body, _COUNTED, False)} {node.comparison} {tight(node.number)}"
            return _in_brackets(text, binding > _UNARY)
        case (body,):
            return f"{word} {formula(body, max(binding, _UNARY), last)}"
        case _:
            own, left, right = _binding(node.operator)
            brackets = own < binding
            last = last or brackets
            *others, final = node.operands
            texts = [formula(operand, left, False) for operand in others]
            return _in_brackets(f" {word} ".join([*texts, formula(final, right, last)]), brackets)


def _binding(operator: str) -> tuple[int, int, int]:
    """Precedence of an infix operator, and the precedences that its left and right operands need."""
    match operator:
        case "and" | "or":
            return _CHAINS[operator], _CHAINS[operator] + 1, _CHAINS[operator] + 1
        case "implies":
            return _IMPLIES, _IMPLIES + 1, _IMPLIES
        case "iff":
            return _IFF, _IFF, _IFF + 1
        case _:
            return _PATH, _PATH, _PATH + 1


def _bounds(node: ast.Window | ast.Length | ast.Period | None) -> str:
    match node:
        case None:
            return ""
        case ast.Window(_, low, high):
            return f"[{loose(low)}, {'end' if high is None else loose(high)}]"
        case ast.Length(_, _, low, high, graph):
            most = "" if high is None else loose(high)
            length = f"<= {most}" if low is None else f"{loose(low)}..{most}"
            return f"[{node.word} {length}{'' if graph is None else f' on {named(graph)}'}]"
        case ast.Period(_, ast.Number() as length):
            return f" {tight(length)}"
        case ast.Period(_, length):
            return f" ({loose(length)})"
        case _:
            assert_never(node)


# ---------------------------------------------------------------- quantities


def agents(node: ast.Name | ast.Member) -> str:
    match node:
        case ast.Name():
            return named(node)
        case ast.Member(_, team, low, high):
            return f"{named(team)}[{loose(low)}{'' if high is None else f'..{loose(high)}'}]"
        case _:
            assert_never(node)


def named(node: ast.Name) -> str:
    """Text of a name, with the indices of a family or of its member."""
    match node:
        case ast.FamilyName(_, text, indices):
            return f"{text}[{_indices(indices)}]"
        case ast.Indexed(_, text, places):
            return f"{text}[{', '.join(map(loose, places))}]"
        case _:
            return node.text


def _indices(nodes: tuple[ast.Index, ...]) -> str:
    return ", ".join(f"{node.name.text} in {loose(node.low)}..{loose(node.high)}" for node in nodes)


def loose(node: ast.Quantity) -> str:
    """Text of a quantity inside brackets, where arithmetic needs no further brackets."""
    return _sum(node)


def tight(node: ast.Quantity) -> str:
    """Text of a quantity, with arithmetic in brackets."""
    return _sum(node, _FACTOR)


def point_text(node: ast.Point) -> str:
    return f"({', '.join(map(loose, node.coordinates))})"


def points(nodes: tuple[ast.Point, ...]) -> str:
    return ", ".join(map(point_text, nodes))


def _sum(node: ast.Quantity, binding: int = _SUM) -> str:
    match node:
        case ast.Name():
            return named(node)
        case ast.Number(_, value, None):
            return _number(value)
        case ast.Number(_, value, unit):
            return f"{_number(value)} {unit}"
        case ast.Negative(_, body):
            return f"-{_sum(body, _FACTOR)}"
        case ast.Arithmetic(_, operator, left, right):
            own = _SUM if operator in "+-" else _PRODUCT
            return _in_brackets(f"{_sum(left, own)} {operator} {_sum(right, own + 1)}", own < binding)
        case ast.Extreme(_, word, parts):
            return f"{word}({', '.join(map(loose, parts))})"
        case ast.Distance(_, ends):
            return f"distance({', '.join(map(agents, ends))})"
        case _:
            assert_never(node)


def _number(value: float) -> str:
    return repr(value).removesuffix(".0")


def _in_brackets(text: str, needed: bool) -> str:
    return f"({text})" if needed else text


def show(program: ast.Program) -> str:
    """Text of a complete mission."""
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
            return f"world {point_text(low)} to {point_text(high)}"
        case ast.Region(_, name, shape):
            return f"region {named(name)} = {shape_text(shape)}"
        case ast.Obstacle(_, name, shape, motion, growth):
            grows = "" if growth is None else f" uncertain {tight(growth)}"
            return f"obstacle {named(name)} = {shape_text(shape)}{_motion(motion)}{grows}"
        case ast.Beacon(_, name, position):
            return f"beacon {named(name)} = {point_text(position)}"
        case ast.Team(_, name, size, items):
            head = f"agent {named(name)}" if size is None else f"team {named(name)}[{loose(size)}]"
            return "\n".join([head + " {", *(f"  {item_text(item)}" for item in items), "}"])
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
            return f"{'maximize' if isinstance(node, ast.Maximize) else 'minimize'} {goal.text}"
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
            return f"{node.word} {point_text(node.value)}"
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
            return f"({formula(body)})"  # its agent would be parsed as the label
        case _:
            return formula(body)


# -------------------------------------------------------------------- shapes


def shape_text(node: ast.Shape, binding: int = 0) -> str:
    """Text of a shape, in brackets if the context with precedence ``binding`` needs them."""
    match node:
        case ast.Name():
            return named(node)
        case ast.Box(_, low, high, height):
            return f"box {point_text(low)} to {point_text(high)}{_height(height)}"
        case ast.Disc(_, centre, radius, height):
            return f"disc at {point_text(centre)} radius {tight(radius)}{_height(height)}"
        case ast.Ball(_, centre, radius):
            return f"ball at {point_text(centre)} radius {tight(radius)}"
        case ast.Cylinder(_, centre, radius, height):
            return f"cylinder at {point_text(centre)} radius {tight(radius)}{_height(height)}"
        case ast.Polygon(_, corners, height):
            return f"polygon {points(corners)}{_height(height)}"
        case ast.Combined(_, operator, left, right):
            own = 2 if operator == "*" else 1
            text = f"{shape_text(left, own)} {operator} {shape_text(right, own + 1)}"
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
            return f" moving {point_text(velocity)}" + ("" if unit is None else f" {unit}")
        case ast.Along(_, waypoints):
            return " along " + ", ".join(
                f"({loose(waypoint.time)}: {', '.join(map(loose, waypoint.offset))})" for waypoint in waypoints
            )
        case ast.AlongFile(_, file):
            return f' along from "{file.path}"'
        case _:
            assert_never(node)


# -------------------------------------------------------------------- agents


def item_text(node: ast.TeamItem) -> str:
    """Text of an item of a team."""
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
            return "(along)"  # a parameter with that name
        case _:
            return tight(angle)


def _places(node: ast.Places) -> str:
    match node:
        case ast.InRegion(_, region):
            return f"in {named(region)}"
        case ast.AtPoints(_, at):
            return f"at {points(at)}"
        case ast.OnLine(_, first, last):
            return f"line {point_text(first)} to {point_text(last)}"
        case ast.OnGrid(_, low, high):
            return f"grid {point_text(low)} to {point_text(high)}"
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
