"""Context of resolution: symbol table, amounts, typed formulas, replacements for invalid items, and findings.

    says MC007 MC101 MC102 MC104

An unknown name is reported with the most similar known name.

An item that cannot be built is reported once, and a stand-in replaces it, so that the rest is still checked: NaN for a
number (every comparison with it is false, so it is reported once), a shape of NaN, a set without agents, a formula that
is true. A mission with errors never leaves ``resolve``, so no stand-in does.

An amount is the value of a quantity: a linear expression in SI units with the exponents of its unit. Numbers are exact
as written, to the last decimal, and so are the results of arithmetic: 0.1 * 3 is 0.3. They are rounded once, at
conversion to ``float``. A typed formula is a resolved formula with its source span, and its subject: one agent or the
team.

Fix that deletes a declaration from the text.

Order of the definitions in a mission: topological order, cycles, and unused names.

    says MC103 MC107

Each definition comes after those that it depends on. A name that nothing refers to is unused. Teams, agents and
obstacles have an effect without a reference, and a map file may contain more than a mission needs. Every graph of
beacons uses a beacon, and every route without ``on`` uses the only graph.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import field
from enum import Enum
from fractions import Fraction
from typing import TypeAlias, TypeVar

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.code import Code
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.diagnostics.suggest import Nothing, nearest
from missionc.base.late_dataclass import Record, dataclass
from missionc.base.limits import Limits
from missionc.base.source import Span
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.references import mentions
from missionc.ir import About

_REST_OF_LINE = re.compile(r"[ \t]*\r?\n")


def deleted(span: Span) -> Fix:
    """Fix that deletes a declaration, with its line if nothing else is on the line."""
    text, start, end = span.source.text, span.start, span.end
    line = text.rfind("\n", 0, start) + 1
    rest = _REST_OF_LINE.match(text, end)
    if rest and not text[line:start].strip():
        start, end = line, rest.end()
    return Fix(Span(span.source, start, end), "")


MOST_LETTERS = 2_000_000
"""Maximum number of letter pairs compared in the search for similar names."""


class Kind(Enum):
    """Kind of declaration that a name refers to; the value is its text in messages."""

    PARAM = "a parameter"
    REGION = "a region"
    OBSTACLE = "an obstacle"
    BEACON = "a beacon"
    TEAM = "a team"
    AGENT = "an agent"
    GROUP = "a group"
    GRAPH = "a graph"
    FORMATION = "a formation"
    RESOURCE = "a resource"
    FLAG = "a flag"
    LET = "a named formula"


STATE_WORDS = ("x", "y", "z", "speed", "altitude")
"""Words for states in comparisons, besides distances; they cannot be names."""

AGENTS = (Kind.TEAM, Kind.AGENT, Kind.GROUP)

Named = (
    ast.Param
    | ast.Region
    | ast.Obstacle
    | ast.Beacon
    | ast.Team
    | ast.Group
    | ast.Graph
    | ast.Formation
    | ast.Resource
    | ast.Flag
    | ast.Let
)


class Unresolved:
    """Result for a name that refers to no suitable declaration; the error has been reported."""


UNRESOLVED = Unresolved()


class Declared(Record):
    kind: Kind
    declaration: Named

    @property
    def span(self) -> Span:
        return self.declaration.name.span


def kind_of(declaration: Named) -> Kind:
    """Kind of a declaration, from the class of its node; a team without a size is an agent."""
    alone = isinstance(declaration, ast.Team) and declaration.size is None
    return Kind.AGENT if alone else Kind[type(declaration).__name__.upper()]


@dataclass(slots=True)
class Names:
    """Symbol table of a mission, in the order of declaration.

    ``suggested`` are the names suggested for unknown ones, which count as used. ``fitting`` caches names by kind.
    """

    declared: dict[str, Declared] = field(default_factory=dict)
    suggested: set[str] = field(default_factory=set)
    letters_left: int = MOST_LETTERS
    fitting: dict[tuple[Kind, ...], list[str]] = field(default_factory=dict)

    def find(
        self, name: ast.Name, kinds: tuple[Kind, ...], needed: str, findings: list[Diagnostic]
    ) -> Declared | Unresolved:
        """Declaration of a name with one of these kinds; if there is none, report that ``needed`` is needed here."""
        declared = self.declared.get(name.text)
        if declared is None:
            findings.append(self._unknown(name, kinds, needed))
            return UNRESOLVED
        if declared.kind not in kinds:
            findings.append(wrong_kind(name, declared, needed, self._fitting(kinds)))
            return UNRESOLVED
        return declared

    def _fitting(self, kinds: tuple[Kind, ...]) -> list[str]:
        """Declared names of these kinds, cached; no declaration may be added after the first call."""
        if kinds not in self.fitting:
            self.fitting[kinds] = [text for text, declared in self.declared.items() if declared.kind in kinds]
        return self.fitting[kinds]

    def _unknown(self, name: ast.Name, kinds: tuple[Kind, ...], needed: str) -> Diagnostic:
        fitting = self._fitting(kinds)
        letters = len(name.text) * sum(map(len, fitting)) if self.letters_left > 0 else 0
        self.letters_left -= letters
        help_text, fix = _ways_out(name.text, kinds, needed, fitting), None
        if self.letters_left > 0:
            match nearest(name.text, list(dict.fromkeys(text.partition("[")[0] for text in fitting))):
                case str() as near:
                    self.suggested.add(near)
                    help_text, fix = f"did you mean `{near}`?", Fix(name.span, near)
                case Nothing():
                    pass
        return Diagnostic(code.UNKNOWN_NAME, f"unknown name `{name.text}`", Label(name.span), help=help_text, fix=fix)


def collect(program: ast.Program, findings: list[Diagnostic]) -> Names:
    """Symbol table of all declared names; the second declaration of a name is reported and ignored."""
    names = Names()
    for declaration in program.declarations:
        if not isinstance(declaration, Named):
            continue
        name = declaration.name
        first = names.declared.get(name.text)
        if name.text in STATE_WORDS:
            findings.append(state_word(name))
        elif first is None:
            names.declared[name.text] = Declared(kind_of(declaration), declaration)
        else:
            findings.append(declared_twice(name, first))
    return names


# ------------------------------------------------------------------ messages


def _ways_out(text: str, kinds: tuple[Kind, ...], needed: str, fitting: list[str]) -> str:
    if kinds == (Kind.PARAM,):
        return f"declare the name with `param {text} = VALUE`"
    if "state" in needed:
        states = ", ".join(f"`{word}`" for word in STATE_WORDS)
        return f"use a state: {states} or `distance(…)`"
    return f"name {needed}: {some_of(fitting)}" if fitting else "declare it"


def some_of(names: list[str], most: int = 5) -> str:
    """Text that lists the first few names, each in backticks."""
    shown = ", ".join(f"`{name}`" for name in names[:most])
    return f"{shown}, …" if len(names) > most else shown


def declared_twice(name: ast.Name, first: Declared) -> Diagnostic:
    return Diagnostic(
        code.NAME_TWICE,
        f"`{name.text}` is declared twice",
        Label(name.span, "second declaration"),
        labels=(Label(first.span, f"{first.kind.value} with this name"),),
        help="rename one of the two declarations",
    )


def state_word(name: ast.Name) -> Diagnostic:
    return Diagnostic(
        code.NAME_NOT_ALLOWED,
        f"`{name.text}` is the name of a state and cannot be declared",
        Label(name.span),
        help="choose another name",
    )


def wrong_kind(name: ast.Name, declared: Declared, needed: str, fitting: list[str]) -> Diagnostic:
    help_text = f"name {needed}: {some_of(fitting)}" if fitting else f"declare {needed}"
    fix = None
    if "state" in needed:
        far = declared.kind in (Kind.REGION, Kind.BEACON, Kind.AGENT)
        help_text = (
            f"use its distance: `distance({name.text})`" if far else "compare a state, a distance or a parameter"
        )
        fix = Fix(name.span, f"distance({name.text})") if far else None
    return Diagnostic(
        code.WRONG_KIND,
        f"expected {needed}, found {declared.kind.value} `{name.text}`",
        Label(name.span),
        labels=(Label(declared.span, "declared here"),),
        help=help_text,
        fix=fix,
    )


Powers: TypeAlias = tuple[int, int, int, int]
"""Exponents of length, time, angle and steps in a unit."""

PLAIN: Powers = (0, 0, 0, 0)
"""Exponents of a number without a unit."""


MOST_BITS = 1 << 11
"""Maximum number of bits in the denominator of an exact number; other numbers are rounded to the nearest ``float``."""


class Amount(Record):
    """Value of a quantity, ``exact + sum(weight * feature)`` in SI units, with its unit exponents.

    ``exact`` is None once an error in the quantity has been reported.
    """

    exact: Fraction | None
    powers: Powers = PLAIN
    terms: tuple[tuple[float, ir.Feature], ...] = ()

    @property
    def constant(self) -> float:
        """Constant part as the nearest ``float``; NaN if an error has been reported."""
        return math.nan if self.exact is None else rounded(self.exact)


def as_written(value: float) -> Fraction:
    """Exact decimal number whose text the ``float`` was read from."""
    return Fraction(repr(value))


def rounded(value: Fraction) -> float:
    """Nearest ``float``, infinite if the value is too large."""
    try:
        return float(value)
    except OverflowError:
        return math.copysign(math.inf, value)


def kept(value: Fraction) -> Fraction:
    """The number itself, or the nearest ``float`` if it needs too many bits."""
    return value if value.denominator.bit_length() <= MOST_BITS else as_written(rounded(value))


class Typed(Record):
    """Resolved formula with its subject, one agent or the team, at one location in the text.

    ``mixed`` is True if some operands are about one agent and some about the team; then ``about`` has no meaning.
    ``operands`` are the formula's own operands that decide this, without those inside a named ``let``. ``size`` counts
    the nodes with every ``let`` expanded, ``depth`` their nesting levels; the size is NaN once it is reported to be too
    large.
    """

    formula: ir.Formula
    about: About
    span: Span
    operands: tuple[Typed, ...] = ()
    mixed: bool = False
    size: float = 1
    depth: int = 1


def joined(operands: tuple[Typed, ...]) -> tuple[About, bool]:
    """Subject of a formula with these operands, and True if they have different subjects."""
    abouts = {operand.about for operand in operands} - {About.EITHER}
    mixed = len(abouts) > 1 or any(operand.mixed for operand in operands)
    return (About.EITHER if mixed or not abouts else abouts.pop()), mixed


D = TypeVar("D")

REPORTED = math.nan
"""Replacement for a number that is invalid and has been reported."""


@dataclass(slots=True)
class Context:
    """State of the resolution of one mission.

    ``dimension`` is 0 and ``step`` NaN while the world and the time are unknown.

    ``members`` and ``edges`` count the expanded members and edges of groups, ranges and formations so far, over the
    complete mission.
    """

    names: Names
    limits: Limits
    findings: list[Diagnostic]
    step: float = REPORTED
    steps: int = 0
    dimension: int = 0
    low: ir.Vector = ()
    high: ir.Vector = ()
    params: dict[str, Amount] = field(default_factory=dict)
    regions: dict[str, ir.Region] = field(default_factory=dict)
    obstacles: dict[str, ir.Obstacle] = field(default_factory=dict)
    beacons: dict[str, ir.Beacon] = field(default_factory=dict)
    agents: list[ir.Agent] = field(default_factory=list)
    sizes: dict[str, float] = field(default_factory=dict)
    sets: dict[str, ir.AgentSet] = field(default_factory=dict)
    graphs: dict[str, ir.Graph] = field(default_factory=dict)
    formations: dict[str, ir.Formation] = field(default_factory=dict)
    resources: dict[str, ir.Resource] = field(default_factory=dict)
    flags: dict[str, ir.Flag] = field(default_factory=dict)
    lets: dict[str, Typed] = field(default_factory=dict)
    everyone: tuple[int, ...] = ()
    vehicle: ir.Vehicle = ir.PLAIN
    """Vehicle of teams that declare none."""
    files: list[ir.PlacesFile] = field(default_factory=list)
    members: int = 0
    edges: int = 0

    def report(
        self,
        code: Code,
        message: str,
        span: Span,
        *,
        beside: str = "",
        labels: tuple[Label, ...] = (),
        notes: tuple[str, ...] = (),
        help: str = "",
        fix: Fix | None = None,
    ) -> None:
        """Add a finding; ``beside`` is the text at its primary label."""
        self.findings.append(Diagnostic(code, message, Label(span, beside), labels, notes, help, fix))

    def report_unknown(
        self,
        code: Code,
        message: str,
        span: Span,
        word: str,
        known: Iterable[str],
        otherwise: str,
        labels: tuple[Label, ...] = (),
    ) -> str | Nothing:
        """Add a finding about an unknown word, with the most similar known word as its fix, and return that word."""
        near = nearest(word, known)
        help_text, fix = (f"did you mean `{near}`?", Fix(span, near)) if isinstance(near, str) else (otherwise, None)
        self.report(code, message, span, labels=labels, help=help_text, fix=fix)
        return near

    def find(self, name: ast.Name, *kinds: Kind, needed: str = "") -> Declared | Unresolved:
        """Declaration of a name with one of these kinds; ``UNRESOLVED`` if there is none, which is reported."""
        return self.names.find(name, kinds, needed or kinds[0].value, self.findings)

    def declared(self, kind: type[D]) -> list[D]:
        """Declarations of one class, in order, without repeated declarations of a name."""
        return [entry.declaration for entry in self.names.declared.values() if isinstance(entry.declaration, kind)]


def in_order(rests_on: Mapping[str, Iterable[str]]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Topological order of the names, and the cycles among them.

    A cycle is a chain of names in which each depends on the next and the last on the first. Its names are in the order
    too, so their users meet a definition that is not resolved yet. Names that are not keys are ignored. The function is
    iterative, because a chain of definitions may be longer than Python's stack.

    Args:
        rests_on: names that each name depends on.
    """
    order: list[str] = []
    cycles: list[tuple[str, ...]] = []
    done: set[str] = set()
    for root in rests_on:
        if root in done:
            continue
        chain = [root]
        place = {root: 0}
        pending = [iter(tuple(rests_on[root]))]
        while chain:
            following = next(pending[-1], "")
            if not following:
                name = chain.pop()
                pending.pop()
                del place[name]
                done.add(name)
                order.append(name)
            elif following in place:
                cycles.append(tuple(chain[place[following] :]))
            elif following in rests_on and following not in done:
                place[following] = len(chain)
                chain.append(following)
                pending.append(iter(tuple(rests_on[following])))
    return order, cycles


ACT_BY_BEING_THERE = (Kind.TEAM, Kind.AGENT, Kind.OBSTACLE)


def unused(names: Names, program: ast.Program) -> list[Diagnostic]:
    """A warning for each unused name, except names suggested for unknown ones; a family is one name."""
    used = set(names.suggested)
    kinds_used: set[Kind] = set()
    for declaration in program.declarations:
        mentioned = mentions(declaration)
        used.update(mentioned.names)
        kinds_used.update([Kind.BEACON] * mentioned.every_beacon + [Kind.GRAPH] * mentioned.only_graph)
    read = {each.span for each in program.declarations if isinstance(each, ast.FromFile)}
    times = Counter(each.name.text for each in program.declarations if isinstance(each, Named))
    return [
        _nothing_uses(name, declared.kind, declared.declaration, once=times[name] == 1)
        for name, declared in names.declared.items()
        if name not in used and declared.kind not in kinds_used and declared.kind not in ACT_BY_BEING_THERE
        if declared.declaration.span not in read
    ]


def _nothing_uses(text: str, kind: Kind, declaration: Named, *, once: bool) -> Diagnostic:
    return Diagnostic(
        code.UNUSED_NAME,
        f"`{text}` is never used",
        Label(declaration.name.span, kind.value),
        help="delete the declaration",
        fix=deleted(declaration.span) if once else None,
    )


def ordered(context: Context, bodies: Mapping[str, object]) -> list[str]:
    """Names in topological order of the references in their bodies; names on a cycle are reported and omitted."""
    rests_on = {name: mentions(body).names for name, body in bodies.items()}
    order, cycles = in_order(rests_on)
    for cycle in cycles:
        _defined_by_itself(context, cycle)
    on_cycles = {name for cycle in cycles for name in cycle}
    return [name for name in order if name not in on_cycles]


def _defined_by_itself(context: Context, cycle: tuple[str, ...]) -> None:
    """Report a cycle of definitions with one finding."""
    spans = [context.names.declared[name].span for name in cycle]
    message, labels = f"`{cycle[0]}` is defined by itself", tuple[Label, ...]()
    if len(cycle) > 1:
        message = f"{len(cycle)} names are defined in a cycle: {_chain(cycle)}"
        labels = tuple(Label(span, "part of the cycle") for span in spans[1:4])
    context.report(
        code.DEFINED_BY_ITSELF, message, spans[0], labels=labels, help="define one of these names without the others"
    )


def _chain(cycle: tuple[str, ...], most: int = 6) -> str:
    names = [f"`{name}`" for name in cycle[:most]]
    if len(cycle) > most:
        names.append("…")
    return " → ".join([*names, f"`{cycle[0]}`"])
