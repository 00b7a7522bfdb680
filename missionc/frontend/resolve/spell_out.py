"""Expansion of families and ``for``: one declaration for each member, a conjunction for ``for``, numbers for indices.

    in   Program
    out  Program without FamilyName, Indexed and ForEach; None if the text is ambiguous
    says MC101 MC102 MC104 MC105 MC107 to MC110 MC207 MC303, and errors of a quantity

A family is a declaration that is repeated for each value of its indices; its members have names. A member shares the
text of its family: its spans record the indices (``Span.turns``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field, replace
from functools import cache
from typing import cast

from missionc.base.diagnostics import code
from missionc.base.diagnostics.code import Code
from missionc.base.diagnostics.model import Diagnostic, Fix, Label, has_errors
from missionc.base.late_dataclass import Record, dataclass
from missionc.base.limits import Limits
from missionc.base.source import Source, Span, Turn
from missionc.frontend.resolve.context import (
    AGENTS,
    STATE_WORDS,
    Context,
    Declared,
    Kind,
    Named,
    Names,
    collect,
    kind_of,
    state_word,
)
from missionc.frontend.resolve.resolve_quantities import excerpt, resolve_parameters, shown, whole
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.references import NOT_REFERENCES, nodes

LEAST_INDEX = -(10**9)
"""Smallest allowed index of a family's member."""


class Env(Record):
    """Values of the indices in scope at a part of the text; empty outside of families and ``for``."""

    turns: tuple[Turn, ...] = ()

    def value(self, name: str) -> int | None:
        """Value of the index with that name, or None if there is none in scope."""
        return next((turn.value for turn in self.turns if turn.name == name), None)

    def span(self, span: Span) -> Span:
        """The span with the present index values recorded."""
        return Span(span.source, span.start, span.end, self.turns) if self.turns else span


NOWHERE = Env()


class Family(Record):
    """Family of declarations; ``members`` maps index values to the members' names and has at least one entry."""

    name: ast.FamilyName
    kind: Kind
    members: Mapping[tuple[int, ...], str]

    @property
    def first(self) -> str:
        """Name of the first member, the replacement for a member that does not exist."""
        return next(iter(self.members.values()))


def member_name(family: str, indices: tuple[int, ...]) -> str:
    """Name of a family's member, such as ``rack[3, 7]``."""
    return f"{family}[{', '.join(map(str, indices))}]"


@dataclass(slots=True)
class Families:
    """Families of a mission by name, and all declared names.

    ``groups`` are the sets of agents that references to families create.
    """

    context: Context
    declared: dict[str, Named]
    families: dict[str, Family] = field(default_factory=dict)
    groups: dict[str, ast.Group] = field(default_factory=dict)

    def add(self, name: ast.FamilyName, declaration: Named, members: Mapping[tuple[int, ...], str]) -> None:
        self.families[name.text] = Family(name, kind_of(declaration), members)

    def member(self, name: ast.Name, indices: tuple[ast.Quantity, ...], whole_span: Span) -> ast.Name:
        """Name of the member with these indices; the first member if there is none, which is reported."""
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
        """All agents of a family, as a group with its name; reported if it is not a family of agents."""
        family = self.families[name.text]
        if family.kind not in AGENTS:
            self._which_one(family, name.span)
            return ast.Name(name.span, family.first)
        return self._group(name.text, name.span, tuple(family.members.values()))

    def some(self, name: ast.Name, low: ast.Quantity, high: ast.Quantity, span: Span) -> ast.Name:
        """Agents of the members from one index to another, as a group."""
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
        """Report an index on a name that is no family, such as ``base[3]``.

        An undeclared name is left to the caller.
        """
        declared = self.declared.get(name.text)
        if declared is None:
            return ast.Name(name.span, name.text)
        kind = kind_of(declared)
        if kind is Kind.TEAM and len(indices) == 2:
            between = Span(span.source, indices[0].span.end, indices[1].span.start, span.turns)
            self.context.report(
                code.NO_SUCH_MEMBER,
                "expected `..` in a range of members",
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
        self.context.report(
            code.FAMILY_AS_ONE,
            f"expected one {kind}, found the family `{excerpt(span)}`",
            span,
            labels=(Label(self.families[text].name.span, "declared here"),),
            help=f"name one member, for example `{family.first}`",
        )

    def _not_there(self, family: Family, asked: tuple[int, ...], span: Span) -> None:
        text, members = family.name.text, list(family.members.values())
        wanted = len(family.name.indices)
        message = f"unknown member `{member_name(text, asked)}`: `{text}` has {shown(len(members))} members"
        if len(asked) != wanted:
            each = ", ".join(f"`{index.name.text}`" for index in family.name.indices)
            number = f"{wanted} {'index' if wanted == 1 else 'indices'}, {each}"
            message = f"`{text}` has {number}; found {len(asked)}"
        self.context.report(
            code.NO_SUCH_INDEX,
            message,
            span,
            labels=(Label(family.name.whole_span, "declared here"),),
            help=f"use one of `{members[0]}` … `{members[-1]}`",
        )


def no_family(context: Context, declared: ast.Name, kind: Kind, span: Span) -> None:
    """Report a reference to a member of a declaration that is not a family."""
    context.report(
        code.NO_SUCH_INDEX,
        f"`{declared.text}` is {kind.value}, not a family: it has no member `{excerpt(span)}`",
        span,
        labels=(Label(declared.span, "declared here"),),
        help=f"write `{declared.text}`",
    )


def reversed_range(context: Context, low: int, high: int, span: Span, way_out: str, fix: Fix | None = None) -> None:
    """Report a range of indices whose end is below its beginning."""
    context.report(code.BOUNDS_REVERSED, f"bounds reversed: {low} is greater than {high}", span, help=way_out, fix=fix)


def mentions_family(nodes: Iterator[object], families: frozenset[str]) -> bool:
    """Return whether these nodes contain anything to expand, in a mission with these families."""
    for node in nodes:
        match node:
            case ast.Indexed() | ast.ForEach() | ast.FamilyName():
                return True
            case ast.Name(text=text) | ast.Member(team=ast.Name(text=text)) if text in families:
                return True
            case _:
                pass
    return False


class UnclearError(Exception):
    """Error: a text is ambiguous and has been reported; nothing else is checked."""


def spell_out(
    program: ast.Program, names: Names, overrides: dict[str, str], limits: Limits, findings: list[Diagnostic]
) -> ast.Program | None:
    """The program with families and ``for`` expanded; None if the text is ambiguous.

    Args:
        names: declared names, each family by its name.
        overrides: values of parameters from the command line.
        findings: list to which errors are added.
    """
    declared = {text: each.declaration for text, each in names.declared.items()}
    families = frozenset(text for text, each in declared.items() if isinstance(each.name, ast.FamilyName))
    spelt = [item for item in program.declarations if mentions_family(nodes(item), families) or _is_family(item)]
    if not spelt:
        return program
    taken = _first_of_each_name(program, names)
    try:
        return replace(program, declarations=tuple(_spelt_out(taken, declared, families, overrides, limits, findings)))
    except UnclearError:
        return None


def _first_of_each_name(program: ast.Program, names: Names) -> list[ast.Declaration]:
    """Declarations of a program without later declarations of a family's name."""
    kept = []
    for item in program.declarations:
        first = names.declared.get(item.name.text) if isinstance(item, Named) else None
        again = first is not None and first.declaration is not item
        if not again or not (_is_family(item) or _is_family(cast(Declared, first).declaration)):
            kept.append(item)
    return kept


def _is_family(item: ast.Declaration) -> bool:
    return isinstance(_name(item), ast.FamilyName)


def _name(item: ast.Declaration) -> ast.Name | None:
    """Name or label of a declaration; None if it has none."""
    return item.label if isinstance(item, ast.Require | ast.Prefer) else getattr(item, "name", None)


def _spelt_out(
    items: list[ast.Declaration],
    declared: dict[str, Named],
    families: frozenset[str],
    overrides: dict[str, str],
    limits: Limits,
    findings: list[Diagnostic],
) -> Iterator[ast.Declaration]:
    params = [item for item in items if isinstance(item, ast.Param)]
    plain = [item for item in params if not mentions_family(nodes(item), families) and not _is_family(item)]
    spelling = _Spelling(Families(_known(plain, overrides, limits, findings), declared), families)
    for param in params:
        if _is_family(param):
            spelling.members(param)
    of_params = [spelt for param in params for spelt in spelling.of_declaration(param)]
    of_all = cast("list[ast.Param]", of_params)
    spelling.known.context = _known(of_all, overrides, limits, findings)
    others = [item for item in items if not isinstance(item, ast.Param)]
    for item in others:
        if _is_family(item) and isinstance(item, Named):
            spelling.members(item)
    spelt = {id(item): spelling.of_declaration(item) for item in others}
    yield from of_params
    for item in others:
        yield from spelt[id(item)]
    yield from spelling.known.groups.values()


def _known(params: list[ast.Param], overrides: dict[str, str], limits: Limits, findings: list[Diagnostic]) -> Context:
    """Context in which quantities with these parameters can be evaluated.

    Errors in parameters are reported elsewhere.
    """
    context = Context(collect(ast.Program(params[0].span, tuple(params)), []) if params else Names(), limits, [])
    resolve_parameters(context, overrides)
    context.findings = findings
    return context


@cache
def _fields(kind: str) -> tuple[tuple[str, bool], ...]:
    """Fields of a kind of node, each with True if it may hold a quantity."""
    written = getattr(ast, kind)
    return tuple((name, "Quantity" in str(written.__annotations__.get(name))) for name in written.__match_args__)


@dataclass(slots=True)
class _Spelling:
    """Expansion of one mission; ``parts`` counts the expanded parts."""

    known: Families
    families: frozenset[str]
    parts: int = 0
    ranges: dict[str, list[Env]] = field(default_factory=dict)

    # ---------------------------------------------------------- declarations

    def members(self, item: Named) -> list[Env]:
        """Index values of each member of a family; the members are registered.

        Raises:
            UnclearError: the family has the name of a state word, which is reported.
        """
        name = item.name
        assert isinstance(name, ast.FamilyName)
        if name.text not in self.ranges:
            if name.text in STATE_WORDS:
                self.known.context.findings.append(state_word(name))
                raise UnclearError
            self.ranges[name.text] = envs = self._turns(name.indices, NOWHERE)
            members = {_values(env): member_name(name.text, _values(env)) for env in envs}
            self.known.add(name, item, members)
        return self.ranges[name.text]

    def of_declaration(self, item: ast.Declaration) -> list[ast.Declaration]:
        """The declaration, or a declaration for each member of a family."""
        name = _name(item)
        if isinstance(name, ast.FamilyName):
            envs = self.members(item) if isinstance(item, Named) else self._turns(name.indices, NOWHERE)
            return [self._member(item, name, env) for env in envs]
        if not mentions_family(nodes(item), self.families):
            return [item]
        return [cast(ast.Declaration, self._copy(item, NOWHERE))]

    def _member(self, item: ast.Declaration, family: ast.FamilyName, env: Env) -> ast.Declaration:
        name = ast.Name(env.span(family.span), member_name(family.text, _values(env)))
        if isinstance(item, ast.Require | ast.Prefer):
            return cast(ast.Declaration, self._copy(replace(item, label=name), env))
        assert isinstance(item, Named)
        return cast(ast.Declaration, self._copy(replace(item, name=name), env))

    # --------------------------------------------------------------- indices

    def _turns(self, indices: tuple[ast.Index, ...], around: Env) -> list[Env]:
        """All combinations of values for these indices, with the last index varying fastest."""
        envs = [around]
        for index in indices:
            self._own_name(index.name, around)
            envs = [Env((*env.turns, turn)) for env in envs for turn in self._values_of(index, env)]
            around = Env((*around.turns, Turn(index.name.text, 0, 0, 0)))
        return envs

    def _values_of(self, index: ast.Index, env: Env) -> list[Turn]:
        """Values of one index; an empty range is reported.

        Raises:
            UnclearError: the range has no value here.
        """
        context, name = self.known.context, index.name.text
        ends = [
            whole(
                context, cast(ast.Quantity, self._copy(end, env, numeric=True)), f"{which} `{name}`", least=LEAST_INDEX
            )
            for end, which in ((index.low, "the first"), (index.high, "the last"))
        ]
        if any(map(math.isnan, ends)):
            raise self._no_value(index, env)
        low, high = map(int, ends)
        if low > high:
            span = env.span(index.low.span.to(index.high.span))
            reversed_range(context, low, high, span, "write the smaller index first")
            raise UnclearError
        self._count(high - low + 1, env.span(index.span))
        return [Turn(name, value, low, high) for value in range(low, high + 1)]

    def _no_value(self, index: ast.Index, env: Env) -> UnclearError:
        """Error for an index whose range depends on a parameter without a value, with a finding unless another one
        explains it.
        """
        if has_errors(self.known.context.findings):
            return UnclearError()
        span = env.span(index.low.span.to(index.high.span))
        message = f"the range of `{index.name.text}` uses a parameter without a value here"
        return self._unclear(code.INDEX_MISPLACED, message, span, "write numbers in place of the parameter")

    def _own_name(self, name: ast.Name, around: Env) -> None:
        """Report an index whose name has another meaning there.

        Raises:
            UnclearError: the name has another meaning.
        """
        text = name.text
        declared = self.known.declared.get(text)
        if text in STATE_WORDS:
            self.known.context.findings.append(state_word(name))
            raise UnclearError
        if around.value(text) is not None:
            message = f"`{text}` is already an index"
            raise self._unclear(code.NAME_TWICE, message, name.span, "choose another name")
        if declared is not None:
            message = f"`{text}` is already declared and cannot be an index"
            here = Label(declared.name.span, "declared here")
            raise self._unclear(code.NAME_TWICE, message, name.span, "choose another name", here)

    # ------------------------------------------------------------------ trees

    def _copy(self, node: object, env: Env, *, numeric: bool = False) -> object:
        """Copy of a part of the tree with the present index values.

        Args:
            numeric: True if a quantity is allowed, so that an index becomes a number.
        """
        if isinstance(node, Span):
            return env.span(node)
        kind = type(node)
        if isinstance(node, Source) or not hasattr(kind, "__match_args__"):
            return node
        self._count(1, cast(ast.Name, node).span)
        match node:
            case ast.Indexed(indices=indices, whole_span=span):
                at = [cast(ast.Quantity, self._copy(each, env, numeric=True)) for each in indices]
                return self.known.member(ast.Name(env.span(node.span), node.text), tuple(at), env.span(span))
            case ast.Name():
                return self._name(node, env, numeric)
            case ast.Member():
                return self._agents(node, env)
            case ast.ForEach():
                return self._for(node, env)
            case _:
                pass
        values: list[object] = []
        for name, takes_numbers in _fields(kind.__name__):  # inline: a function would add a stack frame at each level
            value = getattr(node, name)
            if name in NOT_REFERENCES and isinstance(value, ast.Name):
                values.append(ast.Name(env.span(value.span), value.text))
            elif isinstance(value, tuple):
                parts = []
                for part in value:
                    parts.append(self._copy(part, env, numeric=takes_numbers))  # noqa: PERF401
                values.append(tuple(parts))
            else:
                values.append(self._copy(value, env, numeric=takes_numbers))
        return kind(*values)

    def _name(self, name: ast.Name, env: Env, numeric: bool) -> ast.Name | ast.Number:
        value, span = env.value(name.text), env.span(name.span)
        if value is not None and numeric:
            return ast.Number(span, float(value))
        if value is not None:
            message = f"expected a name, found the index `{name.text}`"
            advice = f"name a member, for example `w[{name.text}]`"
            raise self._unclear(code.INDEX_MISPLACED, message, name.span, advice)
        if name.text in self.families:
            return self.known.all(ast.Name(span, name.text))
        return ast.Name(span, name.text)

    def _agents(self, member: ast.Member, env: Env) -> ast.Name | ast.Member:
        """Copy of a reference to members, such as ``drone[2]``, ``t[i]``, ``t[0..2]`` of a family, or ``t[i][2]``."""
        span, team = env.span(member.span), member.team
        low = cast(ast.Quantity, self._copy(member.low, env, numeric=True))
        high = cast("ast.Quantity | None", self._copy(member.high, env, numeric=True))
        if isinstance(team, ast.Indexed):
            return ast.Member(span, cast(ast.Name, self._copy(team, env)), low, high)
        here = ast.Name(env.span(team.span), team.text)
        if team.text not in self.families:
            return ast.Member(span, here, low, high)
        return self.known.member(here, (low,), span) if high is None else self.known.some(here, low, high, span)

    def _for(self, node: ast.ForEach, env: Env) -> ast.Formula:
        parts = []
        for inner in self._turns(node.indices, env):
            parts.append(cast(ast.Formula, self._copy(node.body, inner)))  # noqa: PERF401
        if len(parts) == 1:
            return parts[0]
        operator = "and" if node.kind == "every" else "or"
        return ast.Apply(env.span(node.span), operator, env.span(node.word_span), tuple(parts))

    def _count(self, parts: int, span: Span) -> None:
        limit = self.known.context.limits.family_parts
        self.parts += parts
        if self.parts > limit:
            message = f"expanded families and `for` have more than {shown(limit)} parts"
            advice = "raise the limit with `--limit family_parts=VALUE`"
            raise self._unclear(code.TOO_LARGE_TO_EXPAND, message, span, advice)

    def _unclear(self, code: Code, message: str, span: Span, advice: str, *labels: Label) -> UnclearError:
        self.known.context.report(code, message, span, labels=labels, help=advice)
        return UnclearError()


def _values(env: Env) -> tuple[int, ...]:
    return tuple(turn.value for turn in env.turns)
