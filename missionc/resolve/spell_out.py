"""Families and ``for`` spelt out: a declaration for each member, a conjunction for ``for``, numbers for indices.

    in   Program
    out  Program without FamilyName, Indexed and ForEach, or nothing where it cannot be told what is meant
    says MC102 MC104 MC105 MC107 to MC110 MC207 MC303, and what is wrong with a quantity

The words of a member are those of its family: their spans say with which
indices they are read (``Span.turns``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field, replace
from functools import cache
from typing import cast

from missionc.base.late_dataclass import dataclass
from missionc.base.limits import Limits
from missionc.base.source import Source, Span, Turn
from missionc.diagnostics import code
from missionc.diagnostics.model import Diagnostic, Label, has_errors
from missionc.resolve.context import Context
from missionc.resolve.families import (
    LEAST_INDEX,
    NOWHERE,
    Env,
    Families,
    member_name,
    mentions_family,
    reversed_range,
)
from missionc.resolve.names import STATE_WORDS, Declared, Named, Names, collect, state_word
from missionc.resolve.resolve_parameters import resolve_parameters
from missionc.resolve.resolve_quantities import shown, whole
from missionc.syntax import ast
from missionc.syntax.references import NOT_REFERENCES, nodes


class UnclearError(Exception):
    """What is meant cannot be told, and that has been reported: nothing is looked at any further."""


def spell_out(
    program: ast.Program, names: Names, overrides: dict[str, str], limits: Limits, findings: list[Diagnostic]
) -> ast.Program | None:
    """The mission without families.

    Args:
        names: what is declared, each family by its name.
        overrides: values of parameters from the command line.
        findings: what is wrong is added to them.
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
    """The declarations but for those of families whose name is taken, and of others that take the name of one."""
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
    """The name or the label of a declaration."""
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
    """Where quantities of these parameters can be evaluated; what is wrong with the parameters is said elsewhere."""
    context = Context(collect(ast.Program(tuple(params), params[0].span), []) if params else Names(), limits, [])
    resolve_parameters(context, overrides)
    context.findings = findings
    return context


@cache
def _fields(kind: str) -> tuple[tuple[str, bool], ...]:
    """The fields of a kind of node, each with whether a quantity may stand there."""
    written = getattr(ast, kind)
    return tuple((name, "Quantity" in str(written.__annotations__[name])) for name in written.__match_args__)


@dataclass(slots=True)
class _Spelling:
    """``parts`` counts what has been spelt out so far."""

    known: Families
    families: frozenset[str]
    parts: int = 0
    ranges: dict[str, list[Env]] = field(default_factory=dict)

    # ---------------------------------------------------------- declarations

    def members(self, item: Named) -> list[Env]:
        """The values of the indices of a family; its members are known from now on."""
        name = item.name
        assert isinstance(name, ast.FamilyName)
        if name.text not in self.ranges:
            if name.text in STATE_WORDS:
                raise self._unclear(state_word(name))
            self.ranges[name.text] = envs = self._turns(name.indices, NOWHERE)
            members = {_values(env): member_name(name.text, _values(env)) for env in envs}
            self.known.add(name, item, members)
        return self.ranges[name.text]

    def of_declaration(self, item: ast.Declaration) -> list[ast.Declaration]:
        """The declaration, or one for each member of a family."""
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
        """Every choice of values for these indices, the last one changing first."""
        envs = [around]
        for index in indices:
            self._own_name(index.name, around)
            envs = [Env((*env.turns, turn)) for env in envs for turn in self._values_of(index, env)]
            around = Env((*around.turns, Turn(index.name.text, 0, 0, 0)))
        return envs

    def _values_of(self, index: ast.Index, env: Env) -> list[Turn]:
        """The values of one index; reported where there is none."""
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
            reversed_range(context, low, high, span, "write a range from the least to the greatest")
            raise UnclearError
        self._count(high - low + 1, env.span(index.span))
        return [Turn(name, value, low, high) for value in range(low, high + 1)]

    def _no_value(self, index: ast.Index, env: Env) -> UnclearError:
        """A finding where none has been reported: the range rests on a parameter that has none."""
        if has_errors(self.known.context.findings):
            return UnclearError()
        span = env.span(index.low.span.to(index.high.span))
        return self._unclear(
            Diagnostic(
                code.INDEX_MISPLACED,
                f"the range of `{index.name.text}` rests on a parameter that has no value here",
                Label(span),
                help="write numbers, or parameters that are no members of a family",
            )
        )

    def _own_name(self, name: ast.Name, around: Env) -> None:
        """An index has a name that means nothing else there."""
        text = name.text
        declared = self.known.declared.get(text)
        if text in STATE_WORDS:
            raise self._unclear(state_word(name))
        if around.value(text) is not None:
            message = f"`{text}` is an index already"
            raise self._unclear(Diagnostic(code.NAME_TWICE, message, Label(name.span), help="choose another name"))
        if declared is not None:
            raise self._unclear(
                Diagnostic(
                    code.NAME_TWICE,
                    f"`{text}` is declared, so it cannot be an index",
                    Label(name.span),
                    (Label(declared.name.span, "declared here"),),
                    help="choose another name",
                )
            )

    # ------------------------------------------------------------------ trees

    def _copy(self, node: object, env: Env, *, numeric: bool = False) -> object:
        """A part of the tree with these indices; ``numeric`` where a quantity may stand."""
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
        for name, takes_numbers in _fields(kind.__name__):  # inline: a function would take a stack frame for each level
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
            message = f"`{name.text}` is an index, which is a number; something else is needed here"
            advice = f"name a member with it, as in `w[{name.text}]`, or compute with it"
            raise self._unclear(Diagnostic(code.INDEX_MISPLACED, message, Label(name.span), help=advice))
        if name.text in self.families:
            return self.known.all(ast.Name(span, name.text))
        return ast.Name(span, name.text)

    def _agents(self, member: ast.Member, env: Env) -> ast.Name | ast.Member:
        """``drone[2]``, ``t[i]``, ``t[0..2]`` of a family, ``t[i][2]``."""
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
            raise self._unclear(
                Diagnostic(
                    code.TOO_LARGE_TO_EXPAND,
                    f"families and `for` are spelt out to more than {shown(limit)} parts up to here",
                    Label(span),
                    help="take smaller ranges, or raise the limit with `--limit family_parts=VALUE`",
                )
            )

    def _unclear(self, finding: Diagnostic) -> UnclearError:
        self.known.context.findings.append(finding)
        return UnclearError()


def _values(env: Env) -> tuple[int, ...]:
    return tuple(turn.value for turn in env.turns)
