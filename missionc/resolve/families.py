"""Families: what is declared once for each value of its indices, and the members by their names.

says MC101 MC105 MC108 MC109
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span, Turn
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix, Label
from missionc.resolve.context import Context
from missionc.resolve.names import AGENTS, Kind, Named, kind_of
from missionc.resolve.resolve_quantities import excerpt, shown, whole
from missionc.syntax import ast

LEAST_INDEX = -(10**9)
"""No index is less: a number may not be either, whatever the limit of its magnitude."""


@dataclass(frozen=True, slots=True)
class Env:
    """The values of the indices around a part of the text; none outside of families and ``for``."""

    turns: tuple[Turn, ...] = ()

    def value(self, name: str) -> int | None:
        """The value of an index of that name, or None where no index has it."""
        return next((turn.value for turn in self.turns if turn.name == name), None)

    def span(self, span: Span) -> Span:
        """A place of the text as it is read with these indices."""
        return Span(span.source, span.start, span.end, self.turns) if self.turns else span


NOWHERE = Env()


@dataclass(frozen=True, slots=True)
class Family:
    """``members`` are names by the values of the indices, one at least."""

    name: ast.FamilyName
    kind: Kind
    members: Mapping[tuple[int, ...], str]

    @property
    def first(self) -> str:
        """What stands in for a member that is not there."""
        return next(iter(self.members.values()))


def member_name(family: str, indices: tuple[int, ...]) -> str:
    """``rack[3, 7]``"""
    return f"{family}[{', '.join(map(str, indices))}]"


@dataclass(slots=True)
class Families:
    """Those of a mission by name, beside all that is ``declared``; ``groups`` are sets of agents that it names."""

    context: Context
    declared: dict[str, Named]
    families: dict[str, Family] = field(default_factory=dict)
    groups: dict[str, ast.Group] = field(default_factory=dict)

    def add(self, name: ast.FamilyName, declaration: Named, members: Mapping[tuple[int, ...], str]) -> None:
        self.families[name.text] = Family(name, kind_of(declaration), members)

    def member(self, name: ast.Name, indices: tuple[ast.Quantity, ...], whole_span: Span) -> ast.Name:
        """The name of the member with these indices, which name no index any more; the first where it is reported."""
        family = self.families.get(name.text)
        if family is None:
            return self._of_no_family(name, indices, whole_span)
        values = [whole(self.context, each, f"the index of `{name.text}`", least=LEAST_INDEX) for each in indices]
        if any(map(math.isnan, values)):
            return ast.Name(whole_span, family.first)
        asked = tuple(int(value) for value in values)
        if asked in family.members:
            return ast.Name(whole_span, family.members[asked])
        self._not_there(family, asked, whole_span)
        return ast.Name(whole_span, family.first)

    def all(self, name: ast.Name) -> ast.Name:
        """The agents of a whole family, as a group that has its name; reported where it is not one of agents."""
        family = self.families[name.text]
        if family.kind not in AGENTS:
            self._which_one(family, name.span)
            return ast.Name(name.span, family.first)
        return self._group(name.text, name.span, tuple(family.members.values()))

    def some(self, name: ast.Name, low: ast.Quantity, high: ast.Quantity, span: Span) -> ast.Name:
        """The agents of the members from one index to another, as a group."""
        family = self.families[name.text]
        if family.kind not in AGENTS or len(family.name.indices) > 1:
            self._which_one(family, span)
            return ast.Name(span, family.first)
        ends = [whole(self.context, each, "the index", least=LEAST_INDEX) for each in (low, high)]
        if any(map(math.isnan, ends)):
            return ast.Name(span, family.first)
        first, last = map(int, ends)
        if first > last:
            words = f"{name.text}[{last}..{first}]"
            reversed_range(self.context, first, last, span, f"write `{words}`", Fix(span, words))
            return ast.Name(span, family.first)
        for end in (first, last):
            if (end,) not in family.members:
                self._not_there(family, (end,), span)
                return ast.Name(span, family.first)
        members = tuple(family.members[index,] for index in range(first, last + 1))
        return self._group(f"{name.text}[{first}..{last}]", span, members)

    def _group(self, text: str, span: Span, members: tuple[str, ...]) -> ast.Name:
        if text not in self.groups:
            named = tuple(ast.Name(span, member) for member in members)
            self.groups[text] = ast.Group(span, ast.Name(span, text), named)
        return ast.Name(span, text)

    # -------------------------------------------------------------- messages

    def _of_no_family(self, name: ast.Name, indices: tuple[ast.Quantity, ...], span: Span) -> ast.Name:
        """``drone[0, 1]``, ``base[3]``; a name that nothing declares is for whoever looks for it."""
        declared = self.declared.get(name.text)
        if declared is None:
            return ast.Name(name.span, name.text)
        kind = kind_of(declared)
        if kind is Kind.TEAM and len(indices) == 2:
            between = Span(span.source, indices[0].span.end, indices[1].span.start, span.turns)
            self.context.report(
                code.NO_SUCH_MEMBER,
                "members of a team are counted `0..2`, with two points",
                between,
                labels=(Label(declared.name.span, "declared here"),),
                help="write `..`",
                fix=Fix(between, ".."),
            )
        else:
            no_family(self.context, declared.name, kind, span)
        return ast.Name(span, name.text)

    def _which_one(self, family: Family, span: Span) -> None:
        text, kind = family.name.text, family.kind.value.split(maxsplit=1)[1]
        indices = [index.name.text for index in family.name.indices]
        self.context.report(
            code.FAMILY_AS_ONE,
            f"`{excerpt(span)}` is a family of {kind}s; one of them is needed here",
            span,
            labels=(Label(self.families[text].name.span, "declared here"),),
            help=f"name one, as in `{family.first}`; of each of them, `for {', '.join(indices)} in …: …"
            f" {text}[{', '.join(indices)}]`",
        )

    def _not_there(self, family: Family, asked: tuple[int, ...], span: Span) -> None:
        text, members = family.name.text, list(family.members.values())
        wanted = len(family.name.indices)
        message = f"`{member_name(text, asked)}` is not there: `{text}` has {shown(len(members))} members"
        if len(asked) != wanted:
            each = ", ".join(f"`{index.name.text}`" for index in family.name.indices)
            number = f"{wanted} {'index' if wanted == 1 else 'indices'}, {each}"
            message = f"`{text}` has {number}; here {'is' if len(asked) == 1 else 'are'} {len(asked)}"
        self.context.report(
            code.NO_SUCH_INDEX,
            message,
            span,
            labels=(Label(family.name.whole_span, "declared here"),),
            help=f"the members are `{members[0]}` … `{members[-1]}`",
        )


def no_family(context: Context, declared: ast.Name, kind: Kind, span: Span) -> None:
    """Reports a member of something that is not a family."""
    context.report(
        code.NO_SUCH_INDEX,
        f"`{declared.text}` is {kind.value} and no family: it has no member `{excerpt(span)}`",
        span,
        labels=(Label(declared.span, "declared here"),),
        help=f"write `{declared.text}`, or declare a family as in `{declared.text}[i in 0..9]`",
    )


def reversed_range(context: Context, low: int, high: int, span: Span, way_out: str, fix: Fix | None = None) -> None:
    """Reports a range of indices that ends before it begins."""
    context.report(code.BOUNDS_REVERSED, f"bounds run backwards: {high} comes after {low}", span, help=way_out, fix=fix)


def mentions_family(nodes: Iterator[object], families: frozenset[str]) -> bool:
    """Whether there is anything to spell out among these nodes, in a mission with these families."""
    for node in nodes:
        match node:
            case ast.Indexed() | ast.ForEach() | ast.FamilyName():
                return True
            case ast.Name(text=text) | ast.Member(team=ast.Name(text=text)) if text in families:
                return True
            case _:
                pass
    return False
