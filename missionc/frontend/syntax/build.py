"""Tree construction from grammar rules: one function for each rule, with its name in ``grammars/mission.lark``.

A function gets the span of its text and the parts that the grammar keeps: nodes, ``ast.Name`` for a name, tokens for
other words and signs. A rule without a function builds the node that it is named after.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, cast

from missionc.base.diagnostics.code import SYNTAX
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.syntax import ast, build_formula
from missionc.frontend.syntax.build_formula import MisreadError, as_formula
from missionc.frontend.syntax.parse_table import load
from missionc.frontend.syntax.tokens import Token, quoted

FORMATIONS = ("line", "chain", "circle", "grid", "star", "offsets", "distances")


class _Total(Record):
    """Intermediate part for ``total tolerance 0.5 m``, until the formation around it is built."""

    setting: ast.Setting


class _OfPairs(Record):
    """Intermediate part for ``{ tower to drone 8 m }``, until the graph around it is built."""

    span: Span
    pairs: tuple[ast.OfPair, ...]


def same(span: Span, node: object) -> object:
    """The node in brackets, or the only part of a rule, unchanged."""
    return node


# -------------------------------------------------------------------- shapes


def combined(span: Span, left: ast.Shape, sign: Token, right: ast.Shape) -> ast.Combined:
    return ast.Combined(span, sign.text, left, right)


def polygon(span: Span, *parts: ast.Point | ast.Height | None) -> ast.Polygon:
    corners = tuple(part for part in parts if isinstance(part, ast.Point))
    height = parts[-1]
    return ast.Polygon(span, corners, height if isinstance(height, ast.Height) else None)


def moving(span: Span, velocity: ast.Point, unit: Token | None) -> ast.Moving:
    if unit is None:
        return ast.Moving(span, velocity)
    return ast.Moving(span, velocity, unit.text, unit.span)


# -------------------------------------------------------------------- agents


def agent(span: Span, name: ast.Name, *items: ast.TeamItem) -> ast.Team:
    return ast.Team(span, name, None, items)


def yaw(span: Span, angle: ast.Quantity | None = None) -> ast.Yaw:
    """Node of a yaw; without an angle for ``along path``, whose words the grammar omits."""
    return ast.Yaw(span, angle)


def setting(span: Span, name: ast.Name, *value: Token | ast.Quantity) -> ast.Setting:
    match value:
        case (Token() as relation, high):
            assert not isinstance(high, Token)
            return ast.Setting(span, name, relation.text, high)
        case (high,):
            assert not isinstance(high, Token)
            return ast.Setting(span, name, "", high)
        case _:
            raise AssertionError(value)


def setting_range(span: Span, name: ast.Name, low: ast.Quantity, sign: Token, high: ast.Quantity) -> ast.Setting:
    """Node of a setting with a range, such as ``speed 1..2 m/s``.

    The unit stays with the upper end; ``resolve`` copies it to the lower one.
    """
    return ast.Setting(span, name, sign.text, high, low)


def between(span: Span, kind: ast.Name, first: ast.Point, last: ast.Point) -> ast.OnLine | ast.OnGrid:
    match kind.text:
        case "line":
            return ast.OnLine(span, first, last)
        case "grid":
            return ast.OnGrid(span, first, last)
        case text:
            message = f"expected `line` or `grid` between two points, found {quoted(text)}"
            raise MisreadError(Diagnostic(SYNTAX, message, Label(kind.span), help="write `line P to P`, for example"))


def file(span: Span, path: Token) -> ast.File:
    return ast.File(path.span, path.text[1:-1])


def from_file(
    span: Span, kind: Token, file: ast.File, *options: ast.Setting | ast.FileOption | ast.Height
) -> ast.FromFile:
    settings = tuple(each for each in options if isinstance(each, ast.Setting))
    heights = tuple(each for each in options if isinstance(each, ast.Height))
    others = tuple(each for each in options if isinstance(each, ast.FileOption))
    return ast.FromFile(span, kind.text, file, settings, others, heights)


def words_of(word: str) -> Callable[..., ast.FileOption]:
    """Function that builds a file option with texts or names after its word."""
    return lambda span, *words: ast.FileOption(span, word, tuple(each.text.strip('"') for each in words))


# --------------------------------------------------------- graphs, formations


def graph(
    span: Span,
    name: ast.Name,
    kind: Token,
    radius: ast.Quantity | None,
    over: ast.Name | ast.Member | None,
    ranges: _OfPairs | None,
    *weights: ast.Weight,
) -> ast.Graph:
    if ranges is not None and kind.text == "beacons":
        message = "a graph of `beacons` has one range for all pairs"
        help = "delete the ranges of pairs"
        raise MisreadError(Diagnostic(SYNTAX, message, Label(ranges.span), help=help))
    return ast.Graph(span, name, kind.text, radius, over, () if ranges is None else ranges.pairs, weights)


def graph_of_pairs(
    span: Span, name: ast.Name, kind: Token, over: ast.Name | ast.Member | None, ranges: _OfPairs, *weights: ast.Weight
) -> ast.Graph:
    return graph(span, name, kind, None, over, ranges, *weights)


def of_pairs(span: Span, *pairs: ast.OfPair) -> _OfPairs:
    return _OfPairs(span, pairs)


def weight(span: Span, name: ast.Name, value: ast.Quantity, pairs: _OfPairs | None) -> ast.Weight:
    return ast.Weight(span, name, value, () if pairs is None else pairs.pairs)


def link(span: Span, ends: ast.Quantity, length: ast.Quantity) -> ast.Link:
    match ends:
        case ast.Arithmetic(_, "-", first, second):
            return ast.Link(span, first, second, length)
        case _:
            message = "a link needs two agents, by their numbers"
            raise MisreadError(Diagnostic(SYNTAX, message, Label(ends.span), help="write `0-1: 0.8 m`"))


def total(span: Span, name: ast.Name, value: ast.Quantity) -> _Total:
    if name.text != "tolerance":
        message = f"expected `tolerance` after `total`, found {quoted(name.text)}"
        raise MisreadError(Diagnostic(SYNTAX, message, Label(name.span), help="write `total tolerance 0.5 m`"))
    return _Total(ast.Setting(span, name, "", value))


def formation(
    span: Span,
    name: ast.Name,
    kind: ast.Name,
    agents: ast.Name | ast.Member,
    places: tuple[ast.Point, ...] | tuple[ast.Link, ...] | ast.File | None,
    *settings: ast.Setting | _Total,
) -> ast.Formation:
    if kind.text not in FORMATIONS:
        message = f"unknown formation {quoted(kind.text)}"
        kinds = ", ".join(f"`{known}`" for known in FORMATIONS)
        raise MisreadError(Diagnostic(SYNTAX, message, Label(kind.span), help=f"use one of {kinds}"))
    listed = (places,) if isinstance(places, ast.File) else places or ()
    points = tuple(place for place in listed if isinstance(place, ast.Point | ast.File))
    links = tuple(place for place in listed if isinstance(place, ast.Link))
    if bool(points) != (kind.text == "offsets") or bool(links) != (kind.text == "distances"):
        takes = {"offsets": "points, such as `(0, 0), (-1, 1)`", "distances": "links, such as `(0-1: 0.8 m)`"}
        message = f"`{kind.text}` takes {takes.get(kind.text, 'neither points nor links')}"
        where = listed[0].span.to(listed[-1].span) if listed else agents.span
        advice = f"write the list after {quoted(agents.span.text)}" if kind.text in takes else "delete the list"
        raise MisreadError(Diagnostic(SYNTAX, message, Label(where), help=advice))
    return ast.Formation(
        span,
        name,
        kind,
        agents,
        tuple(setting.setting if isinstance(setting, _Total) else setting for setting in settings),
        places if isinstance(places, ast.File) else tuple(each for each in points if isinstance(each, ast.Point)),
        links,
        any(isinstance(setting, _Total) for setting in settings),
    )


# -------------------------------------------------------- resources and flags


def rate(span: Span, name: ast.Name, value: ast.Quantity, unit: Token | None, within: ast.Name | None) -> ast.Rate:
    return ast.Rate(span, name, value, None if unit is None else ast.Name(unit.span, unit.text), within)


# -------------------------------------------------------------- declarations


def goal(span: Span, name: ast.Name | Token) -> ast.Name:
    return ast.Name(span, name.text)


def include(span: Span, path: Token) -> ast.Include:
    return ast.Include(span, path.text.strip('"'))


def let(span: Span, name: ast.Name, body: ast.Formula) -> ast.Let:
    return ast.Let(span, name, as_formula(body))


def require(span: Span, label: ast.Name | None, body: ast.Formula) -> ast.Require:
    return ast.Require(span, label, as_formula(body))


def prefer(span: Span, label: ast.Name | None, body: ast.Formula, weight: ast.Quantity | None) -> ast.Prefer:
    return ast.Prefer(span, label, as_formula(body), weight)


def file_setting(span: Span, name: ast.Name, sign: Token, path: Token) -> ast.FileSetting:
    return ast.FileSetting(span, name, path.text[1:-1])


def solve(span: Span, backend: ast.Name, *options: ast.Setting | ast.FileSetting | None) -> ast.Solve:
    settings = tuple(option for option in options if isinstance(option, ast.Setting))
    return ast.Solve(span, backend, settings, tuple(each for each in options if isinstance(each, ast.FileSetting)))


OTHERS: dict[str, Callable[..., object]] = {
    **dict.fromkeys(("graph_kind", "listed_offsets", "name", "parentheses"), same),
    **dict.fromkeys(("compare", "number_compare", "length_of"), same),
    **dict.fromkeys(("links", "offsets"), lambda span, *parts: parts),
    "layers": words_of("layer"),
    "mission": ast.MissionName,
    "named": words_of("named"),
    "origin": lambda span, point: ast.FileOption(span, "origin", point),
    "placed": lambda span, point: ast.FileOption(span, "at", point),
    "unknown": words_of("unknown"),
}
"""Function for each grammar rule that has the name of neither a function nor a node."""


@cache
def functions() -> dict[str, Callable[..., object]]:
    """Function that builds the node for each rule of the grammar, by name."""
    return {rule.name: _function(rule.name) for rule in load().rules if rule.name not in ("", "*")}


def _function(rule: str) -> Callable[..., object]:
    """Function for a grammar rule: the function of that name, or else the node class of that name.

    If the last field of the node is a tuple, it gets all further parts.
    """
    found = OTHERS.get(rule) or globals().get(rule) or getattr(build_formula, rule, None)
    if found is not None:
        return cast(Callable[..., object], found)
    node: Any = getattr(ast, "".join(map(str.capitalize, rule.split("_"))))
    *_, last = fields = node.__match_args__
    first = len(fields) - 2
    if not node.__annotations__[last].startswith("tuple["):
        return cast(Callable[..., object], node)
    return lambda span, *parts: node(span, *parts[:first], tuple(each for each in parts[first:] if each is not None))


NESTS = frozenset(
    {
        *("arithmetic", "negative", "extreme", "extreme_of_terms", "indexed", "call", "term", "minus", "parentheses"),
        *("combined", "comparison", "infix", "bounded_infix", "prefix", "bounded_prefix", "chain", "count"),
        *("quantified", "recurrent", "at_least", "without", "one_agent", "for_every", "for_some"),
    }
)
"""Names of the rules that nest a node in another of its kind, or in brackets."""
