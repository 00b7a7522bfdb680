"""Edits that relax a mission: changes of its text, or of a value from the command line.

Relaxation parameters: numbers of a mission that are weakened by multiples of a step size.

Parameters of conflicting requirements, and the direction of change that weakens each requirement.

in   kernel formulas
out  ConflictTargets
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from missionc.base.diagnostics.model import Fix
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import UNITS
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Change
from missionc.frontend.resolve.resolve_quantities import read_quantity, shown
from missionc.frontend.syntax import ast
from missionc.ir.kernel.nodes import AtLeast, Atom, Node, Not
from missionc.ir.kernel.walk import children, graph_of, route_bounds, window_of

D = TypeVar("D")

ROUND = 9
"""Number of decimals of a changed number, so that no text has 2.0000000000000004 m."""


class Edit(Record):
    """Relaxation of a mission: replacements of spans of the main file, and values of external parameters.

    ``says`` is the change in the mission's terms; ``to`` the new value, if a single number changes.
    """

    says: str
    fixes: tuple[Fix, ...] = ()
    overrides: tuple[tuple[str, str], ...] = ()
    to: str = ""

    def __add__(self, other: Edit) -> Edit:
        return Edit(", ".join((self.says, other.says)), self.fixes + other.fixes, self.overrides + other.overrides)


class Spot(Record):
    """A number of the mission with its location: in the text, or on the command line as ``parameter``."""

    value: float
    unit: str
    place: ast.Quantity | None
    parameter: str = ""

    @property
    def factor(self) -> float:
        """Number of SI units in one unit of the number."""
        return UNITS[self.unit][1] if self.unit else 1.0

    def written(self, value: float) -> str:
        """Text for another value of the number, with its unit."""
        return f"{shown(round(value, ROUND))} {self.unit}".rstrip()

    def put(self, value: float, says: str) -> Edit:
        text = self.written(value)
        if self.place is None:
            return Edit(says, overrides=((self.parameter, text.replace(" ", "")),), to=text)
        return Edit(says, (Fix(self.place.span, text),), to=text)


def spot(checked: Checked, quantity: ast.Quantity | None) -> Spot | None:
    """Location and value of the number behind a quantity; None if it is computed, or in another file.

    The value of a parameter is at its declaration, or on the command line.
    """
    match quantity:
        case ast.Number(value=value, unit=unit) if is_in_main_file(checked, quantity.span):
            return Spot(value, unit or "", quantity)
        case ast.Negative(body=ast.Number(value=value, unit=unit)) if is_in_main_file(checked, quantity.span):
            return Spot(-value, unit or "", quantity)
        case ast.Indexed():
            return None  # one member of a family, which has no separate number
        case ast.Name(text=name) if name in checked.overrides:
            return _given(name, checked)
        case ast.Name(text=name):
            values = (item.value for item in declared(checked, ast.Param) if item.name.text == name)
            return spot(checked, next(values, None))
        case _:
            return None


def _given(name: str, checked: Checked) -> Spot | None:
    value, _ = read_quantity(name, checked.overrides[name], Limits())
    return Spot(value.value, value.unit or "", None, name) if isinstance(value, ast.Number) else None


def is_in_main_file(checked: Checked, span: Span) -> bool:
    """Return whether the span is in the main file, the only one that is edited."""
    return span.source.name == checked.file


def declared(checked: Checked, kind: type[D]) -> list[D]:
    """Declarations of one kind in a mission, in the order of the text."""
    return [item for item in checked.program.declarations if isinstance(item, kind)] if checked.program else []


def edited(checked: Checked, edit: Edit) -> tuple[Source, dict[str, str]]:
    """The main file with an edit applied, and the command-line values."""
    source = checked.sources[0]
    text = _replaced(source.text, edit.fixes)
    return Source(source.name, text), {**checked.overrides, **dict(edit.overrides)}


def changes(edit: Edit, overrides: Mapping[str, str]) -> tuple[Change, ...]:
    """Lines changed by an edit, before and after, in the order of the text.

    Args:
        overrides: values of parameters before the edit.
    """
    changes = [Change("", 0, f"-D {name}={overrides[name]}", f"-D {name}={text}") for name, text in edit.overrides]
    by_lines: dict[tuple[int, int], list[Fix]] = {}
    for fix in sorted(edit.fixes, key=lambda fix: fix.span.start):
        by_lines.setdefault(_lines(fix.span), []).append(fix)
    for (start, end), fixes in by_lines.items():
        source = fixes[0].span.source
        before = source.text[start:end]
        after = _replaced(before, fixes, start)
        changes.append(Change(source.name, source.place(start)[0], before, after.removesuffix("\n")))
    return tuple(changes)


def _lines(span: Span) -> tuple[int, int]:
    """Start and end offset of the complete lines that contain a span."""
    text = span.source.text
    end = text.find("\n", span.end)
    return text.rfind("\n", 0, span.start) + 1, len(text) if end < 0 else end


def _replaced(text: str, fixes: Iterable[Fix], start: int = 0) -> str:
    """The text with the fixes applied.

    Args:
        start: offset of the text in its source.
    """
    for fix in sorted(fixes, key=lambda fix: fix.span.start, reverse=True):
        text = text[: fix.span.start - start] + fix.replacement + text[fix.span.end - start :]
    return text


DOUBLINGS = 2
"""Maximum number of doublings of a number that has no other bound."""


class RelaxationParameter(Record):
    """A number of a mission that can be weakened, with edits of increasing size.

    Args:
        edit: edit that changes the number by some step sizes, from 1 to ``most``; None if the text cannot express it.
        size: step size, relative to the changed value.
        first: number of step sizes tried first.
        most: largest number of step sizes.
    """

    edit: Callable[[int], Edit | None]
    size: float
    first: int = 1
    most: int = 1


def notch(value: float) -> float:
    """Step size for changes of a number: a power of ten, between a tenth and a hundredth of the number."""
    return float(10 ** (math.floor(math.log10(abs(value))) - 1)) if value else 0.1


def more(spot: Spot, name: str, most: float = math.inf) -> RelaxationParameter:
    """Relaxation parameter that increases a number, up to four times its size or ``most``, in its own unit.

    Args:
        name: name of the number, as in "the radius of `radio`".
    """
    by = notch(spot.value)
    room = min(most - spot.value, max(abs(spot.value), 1.0) * (2**DOUBLINGS - 1))
    return _moved(spot, name, by, max(0, math.floor(room / by + 1e-9)))


def less(spot: Spot, name: str, least: float = 0.0) -> RelaxationParameter:
    """Relaxation parameter that decreases a number, down to ``least``, in its own unit."""
    by = notch(spot.value)
    return _moved(spot, name, -by, max(0, math.floor((spot.value - least) / by + 1e-9)))


def whole(spot: Spot, name: str, most: int, by: int = 1) -> RelaxationParameter:
    """Relaxation parameter that increases an integer by up to ``most``, or decreases it if ``by`` is -1."""
    return RelaxationParameter(_put(spot, name, by), 1 / max(1.0, abs(spot.value)), 1, most)


def _moved(spot: Spot, name: str, by: float, most: int) -> RelaxationParameter:
    size = abs(by) / (abs(spot.value) or 1.0)
    return RelaxationParameter(_put(spot, name, by), size, min(most, max(1, round(1 / size))), most)


def _put(spot: Spot, name: str, by: float) -> Callable[[int], Edit]:
    def edit(notches: int) -> Edit:
        value = spot.value + notches * by
        return spot.put(value, f"{name} {spot.written(value)} instead of {spot.written(spot.value)}")

    return edit


Key = TypeVar("Key", Span, str)


class ConflictTarget(Enum):
    """Direction in which a parameter weakens a requirement: larger, smaller, or EITHER if it occurs in both senses."""

    MORE = 1
    LESS = -1
    EITHER = 0


@dataclass(slots=True)
class ConflictTargets:
    """Parameters of conflicting requirements by source text or name, each with its weakening direction.

    ``windows``: last step of a window, or length of a period. ``lengths``: upper bound of a route. ``counts``: number
    of agents. ``comparisons``: value compared with zero, as a sum that has to be positive.
    """

    windows: dict[Span, ConflictTarget] = field(default_factory=dict)
    lengths: dict[Span, ConflictTarget] = field(default_factory=dict)
    counts: dict[Span, ConflictTarget] = field(default_factory=dict)
    comparisons: dict[Span, ConflictTarget] = field(default_factory=dict)
    graphs: dict[str, ConflictTarget] = field(default_factory=dict)
    regions: dict[str, ConflictTarget] = field(default_factory=dict)
    formations: dict[str, ConflictTarget] = field(default_factory=dict)


def conflict_targets(formulas: Iterable[Node]) -> ConflictTargets:
    """Parameters that occur in these required formulas, with their weakening directions."""
    found = ConflictTargets()
    stack = [(formula, 1) for formula in formulas][::-1]
    seen: set[tuple[Node, int]] = set()
    while stack:
        node, sign = stack.pop()
        if (node, sign) in seen:
            continue
        seen.add((node, sign))
        below = -sign if isinstance(node, Not) else sign
        _note(found, node, sign)
        stack.extend((child, below) for child in reversed(children(node)))
    return found


def _note(found: ConflictTargets, node: Node, sign: int) -> None:
    span = node.span
    match node:
        case Atom(predicate):
            if predicate.region:
                _add(found.regions, predicate.region.name, sign)
            elif predicate.formation:
                _add(found.formations, predicate.formation.name, sign)
            else:
                _add(found.comparisons, span, sign)
        case AtLeast():
            # Too few hold if enough of the others fail: the number changes in the other direction.
            _add(found.counts, span, sign if node.dual else -sign)
        case _:
            sign = -sign if node.every else sign
            if (window := window_of(node)) and window[1] is not None:
                _add(found.windows, span, sign)
            if graph := graph_of(node):
                # A wider graph has shorter paths and new links; their effect on a bound is unknown.
                _add(found.graphs, graph.name, sign if children(node) else 0)
            if route_bounds(node):
                _add(found.lengths, span, sign)


def _add(ways: dict[Key, ConflictTarget], key: Key | None, sign: int) -> None:
    if key is not None:
        way = ConflictTarget(sign)
        ways[key] = way if ways.get(key, way) is way else ConflictTarget.EITHER
