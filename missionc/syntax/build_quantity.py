"""Tree construction from grammar rules: quantities, points, and names with indices; see ``build``."""

from __future__ import annotations

from collections.abc import Callable

from missionc.base.source import Span
from missionc.syntax import ast
from missionc.syntax.tokens import Token


def number(span: Span, value: Token, unit: Token | None) -> ast.Number:
    if unit is None:
        return ast.Number(span, float(value.text))
    return ast.Number(span, float(value.text), unit.text, unit.span)


def negative(span: Span, sign: Token, body: ast.Quantity) -> ast.Negative:
    return ast.Negative(span, body)


def arithmetic(span: Span, left: ast.Quantity, sign: Token, right: ast.Quantity) -> ast.Arithmetic:
    return ast.Arithmetic(span, sign.text, left, right)


def extreme(span: Span, word: Token, *parts: ast.Quantity) -> ast.Extreme:
    return ast.Extreme(span, word.text, parts)


def member(span: Span, team: ast.Name, low: ast.Quantity, high: ast.Quantity | None) -> ast.Member:
    return ast.Member(span, team, low, high)


def family(span: Span, name: ast.Name, *indices: ast.Index) -> ast.FamilyName:
    return ast.FamilyName(name.span, name.text, indices, span)


def indexed(span: Span, name: ast.Name, *indices: ast.Quantity) -> ast.Indexed:
    return ast.Indexed(name.span, name.text, indices, span)


def of_team_or_family(span: Span, name: ast.Indexed) -> ast.Member | ast.Indexed:
    """``drone[2]`` and ``rack[2, 3]``; only the second is of a family for sure."""
    if len(name.indices) > 1:
        return name
    return ast.Member(span, ast.Name(name.span, name.text), name.indices[0])


def distance(span: Span, *ends: ast.Name | ast.Member) -> ast.Distance:
    return ast.Distance(span, ends)


def point(span: Span, *coordinates: ast.Quantity) -> ast.Point:
    return ast.Point(span, coordinates)


QUANTITIES: dict[str, Callable[..., object]] = {
    "arithmetic": arithmetic,
    "distance": distance,
    "extreme": extreme,
    "family": family,
    "indexed": indexed,
    "member": member,
    "negative": negative,
    "number": number,
    "of_team_or_family": of_team_or_family,
    "point": point,
}
"""The function for each of these rules."""
