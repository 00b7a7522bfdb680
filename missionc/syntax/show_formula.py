"""Printer of formulas and quantities as written, with no bracket that is not needed."""

from __future__ import annotations

from typing import assert_never

from missionc.syntax import ast

# How tightly an operator binds; an operand that binds less tightly than its place asks for gets brackets.
_IFF, _IMPLIES, _OR, _AND, _PATH, _UNARY, _COUNTED = range(1, 8)
_CHAINS = {"and": _AND, "or": _OR}
_SUM, _PRODUCT, _FACTOR = range(1, 4)


def formula(node: ast.Formula, binding: int = _IFF, last: bool = True) -> str:
    """A formula where nothing binds less tightly than ``binding``.

    ``last`` says that nothing follows within the same brackets: only there may
    a quantifier stand bare, because its body reaches as far right as it can.
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
    """How tightly an operator between operands binds, and how tightly its left and right operands have to."""
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
            return f"[{node.word} {length}{'' if graph is None else f' on {name(graph)}'}]"
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
            return name(node)
        case ast.Member(_, team, low, high):
            return f"{name(team)}[{loose(low)}{'' if high is None else f'..{loose(high)}'}]"
        case _:
            assert_never(node)


def name(node: ast.Name) -> str:
    """A name, with the indices of a family or of its member."""
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
    """A quantity inside brackets, where arithmetic needs none of its own."""
    return _sum(node)


def tight(node: ast.Quantity) -> str:
    """A quantity where arithmetic stands in brackets."""
    return _sum(node, _FACTOR)


def point(node: ast.Point) -> str:
    return f"({', '.join(map(loose, node.coordinates))})"


def points(nodes: tuple[ast.Point, ...]) -> str:
    return ", ".join(map(point, nodes))


def _sum(node: ast.Quantity, binding: int = _SUM) -> str:
    match node:
        case ast.Name():
            return name(node)
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
