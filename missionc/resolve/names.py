"""The symbol table of a mission: names found, or reported with the one that was probably meant."""

from __future__ import annotations

from dataclasses import field
from enum import Enum

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.diagnostics import code
from missionc.diagnostics.model import Diagnostic, Fix, Label
from missionc.diagnostics.suggest import Nothing, nearest
from missionc.syntax import ast

MOST_LETTERS = 2_000_000
"""Pairs of letters compared in search of nearest names; a file that needs more has another trouble than spelling."""


class Kind(Enum):
    """What a name stands for; the value reads well in a message."""

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
"""What a comparison may ask of an agent's own state, beside its distances; never names."""

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
    """The name stands for nothing that fits here, and that has been reported."""


UNRESOLVED = Unresolved()


@dataclass(frozen=True, slots=True)
class Declared:
    kind: Kind
    declaration: Named

    @property
    def span(self) -> Span:
        return self.declaration.name.span


def kind_of(declaration: Named) -> Kind:
    match declaration:
        case ast.Param():
            return Kind.PARAM
        case ast.Region():
            return Kind.REGION
        case ast.Obstacle():
            return Kind.OBSTACLE
        case ast.Beacon():
            return Kind.BEACON
        case ast.Team(size=None):
            return Kind.AGENT
        case ast.Team():
            return Kind.TEAM
        case ast.Group():
            return Kind.GROUP
        case ast.Graph():
            return Kind.GRAPH
        case ast.Formation():
            return Kind.FORMATION
        case ast.Resource():
            return Kind.RESOURCE
        case ast.Flag():
            return Kind.FLAG
        case ast.Let():
            return Kind.LET


@dataclass(slots=True)
class Names:
    """One namespace, in order of declaration.

    ``suggested`` are the names offered in place of unknown ones: they are
    probably used, whatever the text says. ``fitting`` keeps names by their kinds.
    """

    declared: dict[str, Declared] = field(default_factory=dict)
    suggested: set[str] = field(default_factory=set)
    letters_left: int = MOST_LETTERS
    fitting: dict[tuple[Kind, ...], list[str]] = field(default_factory=dict)

    def find(
        self, name: ast.Name, kinds: tuple[Kind, ...], needed: str, findings: list[Diagnostic]
    ) -> Declared | Unresolved:
        """The declaration of a name of one of these kinds; else a finding that says ``needed`` is needed here."""
        declared = self.declared.get(name.text)
        if declared is None:
            findings.append(self._unknown(name, kinds, needed))
            return UNRESOLVED
        if declared.kind not in kinds:
            findings.append(wrong_kind(name, declared, needed, self._fitting(kinds)))
            return UNRESOLVED
        return declared

    def _fitting(self, kinds: tuple[Kind, ...]) -> list[str]:
        """The names of these kinds; nothing is declared any more once this is asked."""
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
        return Diagnostic(
            code.UNKNOWN_NAME, f"nothing is called `{name.text}`", Label(name.span), help=help_text, fix=fix
        )


def collect(program: ast.Program, findings: list[Diagnostic]) -> Names:
    """Every declared name; the first of two counts, the second is reported."""
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
    declare = f"declare it with `param {text} = VALUE`" if kinds == (Kind.PARAM,) else "declare it"
    if "state" in needed:
        states = ", ".join(f"`{word}`" for word in STATE_WORDS)
        return f"{declare}; the states are {states}, `distance(…)`"
    return f"{declare}, or name {needed}: {some_of(fitting)}" if fitting else declare


def some_of(names: list[str], most: int = 5) -> str:
    """The first few names, each in backticks."""
    shown = ", ".join(f"`{name}`" for name in names[:most])
    return f"{shown}, …" if len(names) > most else shown


def declared_twice(name: ast.Name, first: Declared) -> Diagnostic:
    return Diagnostic(
        code.NAME_TWICE,
        f"`{name.text}` is declared twice",
        Label(name.span, "declared again"),
        labels=(Label(first.span, f"{first.kind.value} of this name"),),
        help="give one of them another name",
    )


def state_word(name: ast.Name) -> Diagnostic:
    return Diagnostic(
        code.NAME_NOT_ALLOWED,
        f"`{name.text}` stands for a part of an agent's state",
        Label(name.span),
        help="choose another name",
    )


def wrong_kind(name: ast.Name, declared: Declared, needed: str, fitting: list[str]) -> Diagnostic:
    help_text = f"name {needed}: {some_of(fitting)}" if fitting else f"declare {needed}"
    fix = None
    if "state" in needed:
        far = declared.kind in (Kind.REGION, Kind.BEACON, Kind.AGENT)
        help_text = f"ask how far it is: `distance({name.text})`" if far else "compare states, distances and parameters"
        fix = Fix(name.span, f"distance({name.text})") if far else None
    return Diagnostic(
        code.WRONG_KIND,
        f"`{name.text}` is {declared.kind.value}; {needed} is needed here",
        Label(name.span),
        labels=(Label(declared.span, "declared here"),),
        help=help_text,
        fix=fix,
    )
