"""Open document: its lines, positions, symbol table, and the findings of the last check.

Offsets in the text are converted to the protocol's positions and back, in the client's encoding.

The text may be incomplete. The symbol table contains the readable declarations, and the names in unreadable ones. All
declarations share one namespace; labels of requirements are separate, since they occur only in messages.

Background checks of open texts, and the diagnostics published from their findings.

Checks run one at a time in parallel with requests, and a check of an outdated version is cancelled. A finding in an
included file is shown at the name of the file, with its position in that file as related information.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from posixpath import basename

from lsprotocol import types
from pygls.uris import from_fs_path, to_fs_path

from missionc.base.diagnostics.code import UNUSED_NAME, Severity
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import plain_line
from missionc.base.limits import Limits
from missionc.base.resources import folder
from missionc.base.source import Source, Span
from missionc.compiler.front_end import Checked, check
from missionc.frontend.resolve.context import STATE_WORDS, Kind, Named, kind_of
from missionc.frontend.resolve.resolve_files import with_places
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import passages, read
from missionc.frontend.syntax.read_file import loader
from missionc.frontend.syntax.references import LEAVES, references
from missionc.frontend.syntax.tokens import LABEL, MOST_FINDINGS, NAME, Token, tokenise
from missionc.ir import Mission

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
"""Kind of declared name for each keyword."""


@dataclass(frozen=True, slots=True)
class Name:
    """Occurrence of a name in a text.

    Args:
        text: the name.
        span: span of this occurrence.
        kind: kind of the declared name; None for a label, an index or an undeclared name.
        declares: whether this occurrence declares the name.
        label: whether it is the label of a requirement.
        index: declaration of the index, which is local; None for other names.
    """

    text: str
    span: Span
    kind: Kind | None
    declares: bool = False
    label: bool = False
    index: Span | None = None


@dataclass(frozen=True, eq=False)
class Outline:
    """Symbol table of a text and its included files.

    Args:
        source: text.
        declarations: readable declarations.
        whole: whether the text and its includes have no syntax errors.
        broken: tokens of unreadable passages.
        declared: name of each declaration, with the declaration if it is readable.
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
        program = ast.Program(Span(source, 0, len(source.text)), tuple(declarations))
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
        """All occurrences of all names, also in included files."""
        names = _names(self.declarations, self.broken, self.declared)
        return tuple({(name.span.source.name, name.span.start, name.span.end): name for name in names}.values())

    def at(self, offset: int) -> Name | None:
        """Name at an offset in the text, or ending there; None if there is none."""
        here = [
            name
            for name in self.names
            if name.span.source.name == self.source.name and name.span.start <= offset <= name.span.end
        ]
        return max(here, key=lambda name: name.span.start, default=None)

    def alike(self, name: Name) -> list[Name]:
        """All occurrences of a name; for a label, only the given one."""
        if name.label:
            return [name]
        alike = [other for other in self.names if other.text == name.text and not other.label]
        return [other for other in alike if other.index == name.index]

    def of_kind(self, *kinds: Kind) -> Iterator[Name]:
        """Yield the declaring occurrences of names of these kinds, in order."""
        return (name for name, _ in self.declared.values() if name.kind in kinds)


def _names(
    declarations: tuple[ast.Declaration, ...], broken: tuple[Token, ...], declared: dict[str, tuple[Name, Named | None]]
) -> Iterator[Name]:
    kinds = {text: name.kind for text, (name, _) in declared.items()}
    yield from (name for name, _ in declared.values() if name.span.text == name.text)  # icons have no text
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
    """Yield the tokens of passages with syntax errors, and those after the maximum number of errors.

    Args:
        source: text.
        limits: maximum size of a text.
        findings: syntax errors.
    """
    wrong = [each.primary.span.start for each in findings if each.primary and each.primary.span.source is source]
    left = max(wrong, default=0) if len(findings) >= MOST_FINDINGS else len(source.text)
    for passage in passages(source):
        if passage.end > left or any(passage.start <= place < passage.end for place in wrong):
            tokens, _ = tokenise(passage, limits)
            yield from tokens[:-1]


def _declared_in(tokens: tuple[Token, ...]) -> Iterator[tuple[Token, Kind]]:
    """Yield the names that follow a keyword in unreadable tokens, each with the kind of the keyword."""
    for token, name in pairwise(tokens):
        if token.declares and token.word in KEYWORDS and name.kind == NAME:
            yield name, KEYWORDS[token.word]


def _index_names(declaration: ast.Declaration) -> Iterator[tuple[ast.Name, Span]]:
    """Yield all occurrences of indices, each with the span of its innermost declaration."""
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
        for attribute in getattr(node, "__match_args__", ()):
            value = getattr(node, attribute)
            if not isinstance(value, LEAVES):
                waiting.append((value, scope))


def _family(declaration: ast.Declaration) -> tuple[ast.Index, ...]:
    """Indices in the declared name of a family; empty for other declarations."""
    name = (
        declaration.label if isinstance(declaration, ast.Require | ast.Prefer) else getattr(declaration, "name", None)
    )
    return name.indices if isinstance(name, ast.FamilyName) else ()


def _indices(indices: tuple[ast.Index, ...]) -> dict[str, Span]:
    return {index.name.text: index.name.span for index in indices}


_LINE_END = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    r"""Lines and positions of a text as the protocol counts them.

    A line ends in ``\n``, ``\r\n`` or a single ``\r``.

    Args:
        text: the text.
        encoding: encoding in whose units the client counts columns.
        starts, ends: offsets of the start and the end of each line, the latter before its line end.
    """

    text: str
    encoding: str = types.PositionEncodingKind.Utf16
    starts: tuple[int, ...] = field(init=False, repr=False)
    ends: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        cuts = [match.span() for match in _LINE_END.finditer(self.text)]
        object.__setattr__(self, "starts", (0, *(after for _, after in cuts)))
        object.__setattr__(self, "ends", (*(before for before, _ in cuts), len(self.text)))

    def position(self, offset: int) -> types.Position:
        """Position of the character at an offset; within a line end, the position before it."""
        line = self.line(offset)
        before = self.text[self.starts[line] : min(offset, self.ends[line])]
        return types.Position(line, self._units(before))

    def line(self, offset: int) -> int:
        """Line number of an offset, from 0."""
        return bisect_right(self.starts, offset) - 1

    def offset(self, position: types.Position) -> int:
        """Offset of a position, clipped to the end of its line and of the text.

        A position within a character counts as before it.
        """
        if position.line >= len(self.starts):
            return len(self.text)
        start, end = self.starts[position.line], self.ends[position.line]
        line = self.text[start:end]
        if line.isascii():
            return start + min(position.character, len(line))
        left = position.character
        for place, letter in enumerate(line):
            left -= self._units(letter)
            if left < 0:
                return start + place
        return end

    def range(self, span: Span) -> types.Range:
        return self.between(span.start, span.end)

    def between(self, start: int, end: int) -> types.Range:
        return types.Range(self.position(start), self.position(end))

    def _units(self, text: str) -> int:
        if text.isascii() or self.encoding == types.PositionEncodingKind.Utf32:
            return len(text)
        if self.encoding == types.PositionEncodingKind.Utf8:
            return len(text.encode("utf-8", "surrogatepass"))
        return len(text) + sum(letter > "\uffff" for letter in text)


LIMITS = Limits()


@dataclass(eq=False)
class OpenText:
    """Version of a text that is open in the editor.

    Args:
        uri: URI of the document.
        version: version number in the protocol.
        source: text of the version.
        encoding: encoding in whose units the client counts columns.
        before: mission of the last valid earlier version.
        found: result of its check; None until it is complete.
    """

    uri: str
    version: int
    source: Source
    encoding: str
    before: Mission | None = None
    found: Checked | None = None

    @cached_property
    def places(self) -> Places:
        return Places(self.source.text, self.encoding)

    @cached_property
    def outline(self) -> Outline:
        return Outline.of(self.source, LIMITS)

    @cached_property
    def tokens(self) -> tuple[Token, ...]:
        """All tokens in order, including those of unreadable parts; empty for a text that is too large."""
        if len(self.source.text) > LIMITS.file_bytes:
            return ()
        return tuple(token for passage in passages(self.source) for token in tokenise(passage, LIMITS)[0][:-1])

    @property
    def mission(self) -> Mission | None:
        """Mission of this version if it was checked and is valid; otherwise that of the last valid version."""
        return self.found.mission if self.found and self.found.mission else self.before

    def uri_of(self, source: Source) -> str:
        """URI of this text, or of a file that it includes."""
        if source.name == self.source.name:
            return self.uri
        return from_fs_path(str(Path(source.name).absolute())) or source.name

    def places_in(self, source: Source) -> Places:
        return self.places if source.name == self.source.name else Places(source.text, self.encoding)


def name_of(uri: str) -> str:
    """Name of a document in messages: its path if it has one; escaped if that is not a valid file name."""
    name = to_fs_path(uri) or uri
    try:
        return name if os.fsencode(name) and "\0" not in name else plain_line(name)
    except UnicodeEncodeError:
        return plain_line(name)


SEVERITIES = {Severity.ERROR: types.DiagnosticSeverity.Error, Severity.WARNING: types.DiagnosticSeverity.Warning}
_INCLUDE = re.compile(r'^[ \t]*include\s+"[^"\n]*"', re.MULTILINE)


def diagnostics(text: OpenText, findings: Sequence[Diagnostic]) -> list[types.Diagnostic]:
    return [_diagnostic(text, finding) for finding in findings]


def _diagnostic(text: OpenText, finding: Diagnostic) -> types.Diagnostic:
    span = finding.primary.span if finding.primary else Span(text.source, 0, 0)
    labels = [label for label in finding.labels if label.message]
    elsewhere = span.source.name != text.source.name
    related = [(label.span, label.message) for label in labels]
    if elsewhere:
        related.insert(0, (span, finding.message))
    elif finding.primary and finding.primary.message:
        related.insert(0, (span, finding.primary.message))
    return types.Diagnostic(
        range=text.places.range(_named(text, span) if elsewhere else span),
        message=finding.words,
        severity=SEVERITIES[finding.severity],
        code=finding.code.name,
        code_description=types.CodeDescription((folder("docs/errors") / f"{finding.code.name}.md").as_uri()),
        source="missionc",
        related_information=[_related(text, *place) for place in related] or None,
        tags=[types.DiagnosticTag.Unnecessary] if finding.code is UNUSED_NAME else None,
    )


def _related(text: OpenText, span: Span, message: str) -> types.DiagnosticRelatedInformation:
    places = text.places_in(span.source)
    return types.DiagnosticRelatedInformation(types.Location(text.uri_of(span.source), places.range(span)), message)


def _named(text: OpenText, place: Span) -> Span:
    """First span in this text that names the file of ``place``; else the first ``include``, or the start."""
    named = re.search(rf'"(?:[^"\n]*/)?{re.escape(basename(place.source.name))}"', text.source.text)
    match = named or _INCLUDE.search(text.source.text)
    return Span(text.source, *match.span()) if match else Span(text.source, 0, 0)


PATIENCE = 0.5
"""Maximum seconds that an answer waits for the check of the current version."""

log = logging.getLogger(__name__)


class SupersededError(Exception):
    """Error: the text of a running check has a newer version."""


class Checks:
    """Background checks of open texts.

    Args:
        publish: function that is called in the loop's thread with each checked text that is still current.
    """

    def __init__(self, publish: Callable[[OpenText], None]) -> None:
        self._publish = publish
        self._newest: dict[str, OpenText] = {}
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="check")
        self._closed = False
        self._running: dict[asyncio.Task[None], OpenText] = {}

    def ask(self, text: OpenText) -> None:
        """Start a check of a text, and cancel that of an older version."""
        if self._closed:
            return
        self._newest[text.uri] = text
        task = asyncio.ensure_future(self._run(text))
        self._running[task] = text
        task.add_done_callback(self._running.pop)

    async def settled(self, uri: str) -> None:
        """Wait until the newest version of a text is checked, or until the maximum time."""
        until = time.monotonic() + PATIENCE
        while (left := until - time.monotonic()) > 0:
            running = [task for task, text in self._running.items() if text is self._newest.get(uri)]
            if not running:
                return
            await asyncio.wait(running, timeout=left)

    def forget(self, uri: str) -> None:
        self._newest.pop(uri, None)

    def close(self) -> None:
        self._closed = True
        self._newest.clear()
        self._worker.shutdown(wait=False, cancel_futures=True)

    async def _run(self, text: OpenText) -> None:
        try:
            checked = await asyncio.get_running_loop().run_in_executor(self._worker, self._check, text)
        except SupersededError:
            return
        except Exception:
            log.exception("internal error: this text cannot be checked")
            return
        if self._is_newest(text):
            text.found = checked
            self._publish(text)

    def _check(self, text: OpenText) -> Checked:
        def before(stage: str) -> None:
            if not self._is_newest(text):
                raise SupersededError

        before("reading")
        return check(text.source, limits=LIMITS, before=before)

    def _is_newest(self, text: OpenText) -> bool:
        return self._newest.get(text.uri) is text
