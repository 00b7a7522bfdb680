"""Edits that relax a mission: changes of its text, or of a value from the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
