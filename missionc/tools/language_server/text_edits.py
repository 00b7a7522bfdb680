"""Formatting request: edits that give changed lines the standard layout.

Rename request: changes a name in all files; rejected if the meaning of the text would change.

Quick fixes (code actions): the edits attached to findings.

Folding ranges: blocks in brackets, longer declarations, runs of comments, and runs of one kind of declaration.

Semantic tokens: every name coloured by its kind, at its declaration and its uses.

Requests about names: go to definition, references and highlights; and links to the files that a text names.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from difflib import SequenceMatcher
from itertools import groupby, pairwise
from pathlib import Path, PurePosixPath

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.uris import from_fs_path

from missionc.base.diagnostics.model import Fix
from missionc.base.source import Source
from missionc.frontend.resolve.context import STATE_WORDS, Kind
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import strange, unread
from missionc.frontend.syntax.tokens import TEXT, Token, nameable, quoted, reserved
from missionc.tools.language_server.open_text import LIMITS, Name, OpenText, Outline, diagnostics


def formatting(text: OpenText) -> list[types.TextEdit]:
    """Edits that give a text the standard layout, with unchanged line ends; empty for a text with syntax errors."""
    written = text.source.text
    mark = written[:1] if written.startswith("\ufeff") else ""
    source = Source(text.source.name, written[len(mark) :])
    program, _ = parse(source, LIMITS, unread)
    if program is None:
        return []
    wanted = mark + format_mission(source, program, LIMITS)
    if "\r\n" in written:
        wanted = wanted.replace("\n", "\r\n")
    before, after = written.splitlines(keepends=True), wanted.splitlines(keepends=True)
    starts = [0]
    for line in before:
        starts.append(starts[-1] + len(line))
    return [
        types.TextEdit(text.places.between(starts[first], starts[last]), "".join(after[low:high]))
        for word, first, last, low, high in SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
        if word != "equal"
    ]


REQUEST_FAILED = int(types.LSPErrorCodes.RequestFailed)


class RefusedError(JsonRpcException):
    """Error: a name cannot be renamed, for the given reason, which the editor shows."""

    CODE = REQUEST_FAILED


def renamable(text: OpenText, position: types.Position) -> types.PrepareRenamePlaceholder:
    """Range and text of the name at a position.

    Raises:
        RefusedError: there is no name, or another file declares it.
    """
    name = _name(text, position)
    return types.PrepareRenamePlaceholder(text.places.range(name.span), name.text)


def rename(text: OpenText, position: types.Position, new: str) -> types.WorkspaceEdit:
    """Edits that rename the name at a position, by file.

    Args:
        text: open text.
        position: position in the protocol's units.
        new: new name.

    Raises:
        RefusedError: there is no name, the text has syntax errors, or the new name is taken or invalid.
    """
    name, outline = _name(text, position), text.outline
    if new == name.text:
        return types.WorkspaceEdit(changes={})
    _check(new, name, outline)
    if not outline.whole:
        raise RefusedError("the text has syntax errors; correct them before you rename a name")
    places = sorted(outline.alike(name), key=lambda other: (other.span.source.name, other.span.start))
    _keeps_its_meaning(text, name, new, places)
    changes: dict[str, list[types.TextEdit]] = {}
    for source, others in groupby(places, key=lambda other: other.span.source):
        lines = text.places_in(source)
        changes[text.uri_of(source)] = [types.TextEdit(lines.range(other.span), new) for other in others]
    return types.WorkspaceEdit(changes=changes)


def _name(text: OpenText, position: types.Position) -> Name:
    name = text.outline.at(text.places.offset(position))
    if name is None:
        raise RefusedError("no name of the mission at this position")
    if name.label or name.index is not None:
        return name
    if name.text not in text.outline.declared:
        raise RefusedError(f"unknown name `{name.text}`")
    declared = text.outline.declared[name.text][0].span
    source = declared.source
    if declared.text != name.text:
        raise RefusedError(f"`{name.text}` is a generated name; set another name with `named`")
    if source.name != text.source.name:
        raise RefusedError(f"`{name.text}` is declared in `{source.name}`: rename it there")
    return name


def _check(new: str, name: Name, outline: Outline) -> None:
    if not nameable(new):
        raise RefusedError(f"`{new}` is not a valid name; use the letters a to z, digits and `_`, and no digit first")
    if len(new) > LIMITS.name_length:
        raise RefusedError(f"the name has {len(new)} characters; the limit is {LIMITS.name_length}")
    if reserved(new) and not name.label:
        raise RefusedError(f"`{new}` is a reserved word")
    if new in STATE_WORDS and not name.label:
        raise RefusedError(f"`{new}` is a part of an agent's state")
    if any(other.text == new and other.label == name.label for other in outline.names):
        raise RefusedError(f"`{new}` is already declared")


def _keeps_its_meaning(text: OpenText, name: Name, new: str, places: list[Name]) -> None:
    """Check that the renamed text has the same tree; some words are allowed as names only in some positions.

    Args:
        text: open text.
        name: name to replace.
        new: new name.
        places: all occurrences of the name.

    Raises:
        RefusedError: the renamed text reads differently.
    """
    parts, end = [], 0
    for place in (place for place in places if place.span.source is text.source):
        parts += [text.source.text[end : place.span.start], new]
        end = place.span.end
    renamed = Source(text.source.name, "".join([*parts, text.source.text[end:]]))
    after = Outline.of(renamed, LIMITS)
    mine = [other for other in places if other.span.source is text.source]
    matches = [other for other in after.names if other.text == new and other.label == name.label]
    there = [other for other in matches if other.span.source is renamed]
    if not after.whole or len(there) != len(mine):
        raise RefusedError(f"`{new}` has another meaning where the mission uses `{name.text}`")


def fixes(text: OpenText, wanted: types.Range) -> list[types.CodeAction]:
    """Code actions with the fixes of the findings in a range; none until this version of the text is checked."""
    findings = text.found.findings if text.found else ()
    first, last = text.places.offset(wanted.start), text.places.offset(wanted.end)
    actions = []
    for finding in findings:
        if finding.fix is None or finding.primary is None:
            continue
        span = finding.primary.span
        if span.source.name != text.source.name or finding.fix.span.source.name != text.source.name:
            continue
        if first <= span.end and span.start <= last:
            edit = types.TextEdit(text.places.range(finding.fix.span), finding.fix.replacement)
            actions.append(
                types.CodeAction(
                    title=title(finding.fix),
                    kind=types.CodeActionKind.QuickFix,
                    diagnostics=diagnostics(text, [finding]),
                    edit=types.WorkspaceEdit(changes={text.uri: [edit]}),
                    is_preferred=True,
                )
            )
    return actions


def title(fix: Fix) -> str:
    """Description of a fix in one line, for the menu."""
    old, new = (quoted(" ".join(words.split())) for words in (fix.span.text, fix.replacement))
    if not fix.span.text.strip():
        return f"Insert {new}"
    return f"Replace {old} by {new}" if fix.replacement else f"Delete {old}"


_CLOSES = {"}": "{", ")": "(", "]": "["}


def folds(text: OpenText) -> list[types.FoldingRange]:
    """Folding ranges of a text, at most one for each first line; a block has priority over its declaration."""
    found = [*_blocks(text), *_declarations(text), *_comments(text)]
    by_line: dict[int, types.FoldingRange] = {}
    for fold in found:
        by_line.setdefault(fold.start_line, fold)
    return sorted(by_line.values(), key=lambda fold: fold.start_line)


def _blocks(text: OpenText) -> Iterator[types.FoldingRange]:
    """Yield the ranges between brackets; the line of a closing bracket that begins the line stays visible."""
    open_: list[Token] = []
    for token in text.tokens:
        if _begins(token):
            open_.clear()  # brackets not closed before the next declaration never are
        if token.kind in _CLOSES.values():
            open_.append(token)
        elif token.kind in _CLOSES:
            while open_ and open_[-1].kind != _CLOSES[token.kind]:
                open_.pop()
            if open_:
                first, last = _line(text, open_.pop()), _line(text, token)
                yield from _fold(first, last - 1 if token.starts_line else last)


def _declarations(text: OpenText) -> Iterator[types.FoldingRange]:
    """Yield the ranges of multi-line declarations, and of runs of single-line declarations with the same keyword."""
    spans = [(kind, _line(text, first), _line(text, last)) for kind, first, last in _spans(text.tokens)]
    for _, first, last in spans:
        yield from _fold(first, last)
    short = [(kind, first) for kind, first, last in spans if first == last]
    for (kind, _), lines in groupby(enumerate(short), key=lambda entry: (entry[1][0], entry[1][1] - entry[0])):
        places = [line for _, (_, line) in lines]
        yield from _fold(places[0], places[-1], types.FoldingRangeKind.Imports if kind == "include" else None)


def _spans(tokens: Iterable[Token]) -> Iterator[tuple[str, Token, Token]]:
    """Yield the keyword, first token and last token of each declaration that begins a line."""
    begun: Token | None = None
    last: Token | None = None
    for token in tokens:
        if _begins(token):
            if begun and last:
                yield begun.word, begun, last
            begun = token
        last = token
    if begun and last:
        yield begun.word, begun, last


def _begins(token: Token) -> bool:
    """Return whether a token begins both a line and a declaration."""
    return token.starts_line and token.declares


def _comments(text: OpenText) -> Iterator[types.FoldingRange]:
    written, places = text.source.text, text.places
    lines = [
        number
        for number, (start, end) in enumerate(zip(places.starts, places.ends, strict=True))
        if written[start:end].lstrip().startswith("#")
    ]
    for _, run in groupby(enumerate(lines), key=lambda entry: entry[1] - entry[0]):
        numbers = [line for _, line in run]
        yield from _fold(numbers[0], numbers[-1], types.FoldingRangeKind.Comment)


def _line(text: OpenText, token: Token) -> int:
    return text.places.line(token.span.start)


def _fold(first: int, last: int, kind: types.FoldingRangeKind | None = None) -> Iterator[types.FoldingRange]:
    if last > first:
        yield types.FoldingRange(start_line=first, end_line=last, kind=kind)


Colour = types.SemanticTokenTypes

COLOURS = {
    Kind.PARAM: Colour.Parameter,
    Kind.REGION: Colour.Type,
    Kind.OBSTACLE: Colour.Struct,
    Kind.BEACON: Colour.EnumMember,
    Kind.TEAM: Colour.Class,
    Kind.AGENT: Colour.Class,
    Kind.GROUP: Colour.Class,
    Kind.GRAPH: Colour.Interface,
    Kind.FORMATION: Colour.Enum,
    Kind.RESOURCE: Colour.Property,
    Kind.FLAG: Colour.Property,
    Kind.LET: Colour.Function,
}
"""Token type by kind of name; only types of the protocol, for which every theme has a colour."""

LABEL, INDEX = Colour.Event, Colour.Variable
TYPES = tuple(dict.fromkeys((*COLOURS.values(), LABEL, INDEX)))
DECLARATION = 1
LEGEND = types.SemanticTokensLegend(
    [each.value for each in TYPES], [types.SemanticTokenModifiers.Declaration.value]
)  # one bit for each modifier, the lowest for the first


def semantic_tokens(text: OpenText) -> types.SemanticTokens:
    """Semantic tokens of a text, encoded as five numbers each: line and character offsets, length, type, modifiers."""
    data: list[int] = []
    line = character = 0
    own = [name for name in text.outline.names if name.span.source.name == text.source.name]
    for name in sorted(own, key=lambda name: name.span.start):
        colour = _colour(name)
        if colour is None or name.span.text != name.text:
            continue
        here = text.places.range(name.span)
        start, length = here.start, here.end.character - here.start.character
        across = start.character - character if start.line == line else start.character
        data += [start.line - line, across, length, TYPES.index(colour), DECLARATION if name.declares else 0]
        line, character = start.line, start.character
    return types.SemanticTokens(data)


def _colour(name: Name) -> Colour | None:
    """Token type of a name; None if it is undeclared."""
    if name.label:
        return LABEL
    if name.index is not None:
        return INDEX
    return COLOURS[name.kind] if name.kind is not None else None


BEFORE = frozenset({"include", "from", "="})
"""Tokens before the name of a file: ``include "…"``, ``from "…"``, ``roadmap = "…"``."""


def links(text: OpenText) -> list[types.DocumentLink]:
    """Links to the files that a text names by a relative path, existing or not; none for a text that is not on disk."""
    if not text.uri.startswith("file:"):
        return []
    folder = Path(text.source.name).absolute().parent
    found = []
    for before, token in pairwise(text.tokens):
        written = token.text[1:-1]
        if token.kind != TEXT or before.text not in BEFORE or strange(written):
            continue
        span = token.span
        inner = text.places.between(span.start + 1, span.end - 1)
        target = from_fs_path(str(folder / PurePosixPath(written)))
        found.append(types.DocumentLink(inner, target, f"Open {written}"))
    return found


def definition(text: OpenText, position: types.Position) -> types.Location | None:
    name = text.outline.at(text.places.offset(position))
    if name is None:
        return None
    if name.label:
        return _location(text, name)
    if name.index is not None:
        return _location(text, replace(name, span=name.index))
    declared = text.outline.declared.get(name.text)
    return _location(text, declared[0]) if declared else None


def references(text: OpenText, position: types.Position, declaration: bool) -> list[types.Location]:
    """All uses of the name at a position, also in included files; empty if there is no name.

    Args:
        text: open text.
        position: position in the protocol's units.
        declaration: whether to include the declaration.
    """
    name = text.outline.at(text.places.offset(position))
    if name is None:
        return []
    return [_location(text, other) for other in text.outline.alike(name) if declaration or not other.declares]


def highlights(text: OpenText, position: types.Position) -> list[types.DocumentHighlight]:
    name = text.outline.at(text.places.offset(position))
    if name is None:
        return []
    write, read = types.DocumentHighlightKind.Write, types.DocumentHighlightKind.Read
    return [
        types.DocumentHighlight(text.places.range(other.span), write if other.declares else read)
        for other in text.outline.alike(name)
        if other.span.source.name == text.source.name
    ]


def _location(text: OpenText, name: Name) -> types.Location:
    return types.Location(text.uri_of(name.span.source), text.places_in(name.span.source).range(name.span))
