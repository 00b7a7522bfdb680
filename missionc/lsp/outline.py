"""The symbol table of a text that may be incomplete: its declarations, and the names in those that cannot be read.

One namespace holds all that is declared; a requirement's label names it for messages and stands apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.diagnostics.model import Diagnostic
from missionc.resolve.names import STATE_WORDS, Kind, Named, kind_of
from missionc.resolve.resolve_files import with_places
from missionc.syntax import ast
from missionc.syntax.parse import read
from missionc.syntax.passages import passages
from missionc.syntax.read_file import loader
from missionc.syntax.references import LEAVES, references
from missionc.syntax.tokens import LABEL, MOST_FINDINGS, NAME, Token, tokenise

KEYWORDS = {
    "param": Kind.PARAM,
    "region": Kind.REGION,
    "obstacle": Kind.OBSTACLE,
    "beacon": Kind.BEACON,
    "team": Kind.TEAM,
    "agent": Kind.AGENT,
    "group": Kind.GROUP,
    "graph": Kind.GRAPH,
    "formation": Kind.FORMATION,
    "resource": Kind.RESOURCE,
    "flag": Kind.FLAG,
    "let": Kind.LET,
}
"""What each word declares."""


@dataclass(frozen=True, slots=True)
class Name:
    """A place where a name stands; ``kind`` is None for a label, for an index and where nothing declares it.

    ``index`` is where an index is named, if it is one: it means something around there alone.
    """

    text: str
    span: Span
    kind: Kind | None
    declares: bool = False
    label: bool = False
    index: Span | None = None


@dataclass(frozen=True, eq=False)
class Outline:
    """``whole``: the text, and what it includes, reads without a finding.

    ``declared`` are names with what they declare, where that can be read.
    """

    source: Source
    declarations: tuple[ast.Declaration, ...]
    whole: bool
    broken: tuple[Token, ...]
    declared: dict[str, tuple[Name, Named | None]]

    @staticmethod
    def of(source: Source, limits: Limits) -> Outline:
        declarations, findings = read(source, limits, loader(Path(source.name), source.name, limits))
        broken = tuple(_unread(source, limits, findings)) if len(source.text) <= limits.file_bytes else ()
        declared: dict[str, tuple[Name, Named | None]] = {}
        program = ast.Program(tuple(declarations), Span(source, 0, len(source.text)))
        for declaration in with_places(program, {}, limits)[0].declarations:
            if isinstance(declaration, Named):
                name = declaration.name
                entry = Name(name.text, name.span, kind_of(declaration), declares=True)
                declared.setdefault(name.text, (entry, declaration))
        for name_token, kind in _declared_in(broken):
            entry = Name(name_token.text, name_token.span, kind, declares=True)
            declared.setdefault(name_token.text, (entry, None))
        return Outline(source, tuple(declarations), not findings, broken, declared)

    @cached_property
    def names(self) -> tuple[Name, ...]:
        """Every place of every name, included files' too."""
        names = _names(self.declarations, self.broken, self.declared)
        return tuple({(name.span.source.name, name.span.start, name.span.end): name for name in names}.values())

    def at(self, offset: int) -> Name | None:
        """The name at a place in the text, or that ends there."""
        here = [
            name
            for name in self.names
            if name.span.source.name == self.source.name and name.span.start <= offset <= name.span.end
        ]
        return max(here, key=lambda name: name.span.start, default=None)

    def alike(self, name: Name) -> list[Name]:
        """Every place of a name: of a label, its own."""
        if name.label:
            return [name]
        alike = [other for other in self.names if other.text == name.text and not other.label]
        return [other for other in alike if other.index == name.index]

    def of_kind(self, *kinds: Kind) -> Iterator[Name]:
        """What is declared of these kinds, in order."""
        return (name for name, _ in self.declared.values() if name.kind in kinds)


def _names(
    declarations: tuple[ast.Declaration, ...], broken: tuple[Token, ...], declared: dict[str, tuple[Name, Named | None]]
) -> Iterator[Name]:
    kinds = {text: name.kind for text, (name, _) in declared.items()}
    yield from (name for name, _ in declared.values() if name.span.text == name.text)  # a picture has none written
    for declaration in declarations:
        match declaration:
            case ast.Require(label=ast.Name() as label) | ast.Prefer(label=ast.Name() as label):
                yield Name(label.text, label.span, None, declares=True, label=True)
            case _ if isinstance(declaration, Named):
                name = declaration.name
                yield Name(name.text, name.span, kind_of(declaration), declares=True)
        indices = {index.span: named for index, named in _index_names(declaration)}
        for span, named in indices.items():
            yield Name(span.text, span, None, declares=span == named, index=named)
        for name in references(declaration):
            if name.text not in STATE_WORDS and name.span not in indices:
                yield Name(name.text, name.span, kinds.get(name.text))
    starts = {token.span.start for token, _ in _declared_in(broken)}
    for token in broken:
        if token.kind == LABEL:
            yield Name(token.text, token.span, None, declares=True, label=True)
        elif token.kind == NAME and token.text in kinds:
            yield Name(token.text, token.span, kinds[token.text], declares=token.span.start in starts)


def _unread(source: Source, limits: Limits, findings: list[Diagnostic]) -> Iterator[Token]:
    """The words of the passages in which something is wrong, and of those after too many errors."""
    wrong = [each.primary.span.start for each in findings if each.primary and each.primary.span.source is source]
    left = max(wrong, default=0) if len(findings) >= MOST_FINDINGS else len(source.text)
    for passage in passages(source):
        if passage.end > left or any(passage.start <= place < passage.end for place in wrong):
            tokens, _ = tokenise(passage, limits)
            yield from tokens[:-1]


def _declared_in(tokens: tuple[Token, ...]) -> Iterator[tuple[Token, Kind]]:
    """The names that unread words seem to declare."""
    for token, name in pairwise(tokens):
        if token.declares and token.word in KEYWORDS and name.kind == NAME:
            yield name, KEYWORDS[token.word]


def _index_names(declaration: ast.Declaration) -> Iterator[tuple[ast.Name, Span]]:
    """Every place where an index stands, with the place that names it: the innermost one around it."""
    waiting: list[tuple[object, Mapping[str, Span]]] = [(declaration, _indices(_family(declaration)))]
    while waiting:
        node, scope = waiting.pop()
        if isinstance(node, tuple):
            waiting += [(part, scope) for part in node]
            continue
        if isinstance(node, ast.ForEach):
            scope = {**scope, **_indices(node.indices)}
        if isinstance(node, ast.Index):
            yield node.name, node.name.span
            waiting += [(node.low, scope), (node.high, scope)]
            continue
        if type(node) is ast.Name and node.text in scope:
            yield node, scope[node.text]
        for field in getattr(node, "__match_args__", ()):
            value = getattr(node, field)
            if not isinstance(value, LEAVES):
                waiting.append((value, scope))


def _family(declaration: ast.Declaration) -> tuple[ast.Index, ...]:
    """The indices of a declaration that is a family; none of any other."""
    name = (
        declaration.label if isinstance(declaration, ast.Require | ast.Prefer) else getattr(declaration, "name", None)
    )
    return name.indices if isinstance(name, ast.FamilyName) else ()


def _indices(indices: tuple[ast.Index, ...]) -> dict[str, Span]:
    return {index.name.text: index.name.span for index in indices}
