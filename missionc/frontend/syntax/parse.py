"""The parser: from text to the syntax tree, with the declarations of included files inserted.

    in   Source
    out  Program
    says MC001, MC003 to MC008, MC011 to MC013, MC033, MC202, and the codes of ``load``

Declarations are parsed one by one: after an error in one, parsing continues at the next, so that all errors of a file
are found in one run.

Passages of a text: parts that can be parsed independently of each other.

A passage begins at the start of a line with a word that declares something: there every earlier declaration ends, even
with errors, and no character depends on earlier ones. Most passages contain one declaration.

Table-driven LALR parser that takes tokens one at a time and can report which tokens may come next.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import NamedTuple, TypeAlias, cast

from missionc.base.diagnostics import code as codes
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.limits import DEEPEST, Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast, parse_table
from missionc.frontend.syntax.build import NESTS, functions
from missionc.frontend.syntax.build_formula import MisreadError
from missionc.frontend.syntax.hints import explain
from missionc.frontend.syntax.parse_table import END, Rule, Table
from missionc.frontend.syntax.read_file import LINK, Files, Loader
from missionc.frontend.syntax.stopping_place import Place
from missionc.frontend.syntax.tokens import (
    BEFORE_FILE,
    DECLARATIONS,
    LABEL,
    MOST_FINDINGS,
    NAME,
    PLURALS,
    Token,
    tokenise,
)

# After `require`, any word before a colon is a label.
_ONE, _SEVERAL = "|".join(sorted(DECLARATIONS - PLURALS)), "|".join(sorted(PLURALS))
_BEGINS = re.compile(rf"^[ \t]*(?:(?:{_ONE})\b(?!\s*:)|(?:{_SEVERAL})\b{BEFORE_FILE})", re.MULTILINE)


def passages(source: Source) -> Iterator[Span]:
    """Yield the passages of a source in order; together they are the complete text."""
    begin = 0
    for match in _BEGINS.finditer(source.text):
        if match.start() > begin:
            yield Span(source, begin, match.start())
        begin = match.start()
    yield Span(source, begin, len(source.text))


class Part(NamedTuple):
    """Value that the parser built for a part of the text, with its span (brackets included) and nesting depth."""

    value: object
    span: Span
    depth: int


class Ahead(NamedTuple):
    """Simulated effects of a token: reductions, which keep ``below`` of the parser states and push others.

    ``state`` is the state after the token.
    """

    state: int
    rules: list[Rule]
    below: int
    above: list[int]


REFUSED = Ahead(-1, [], 0, [])
"""Result of ``Machine._ahead`` for a token that is not allowed next."""


class TooDeepError(Exception):
    """Error: a node is nested deeper than the limit; ``part`` is a word in it."""

    def __init__(self, part: Part) -> None:
        super().__init__()
        self.part = part


class Machine:
    """Parser state for one text; nothing here recurses, however deep the text is nested.

    ``functions`` builds the node of each rule from its span and parts; rules named in ``nests`` lie one level deeper
    than their deepest part.
    """

    def __init__(
        self, table: Table, functions: Mapping[str, Callable[..., object]], nests: frozenset[str], nesting: int
    ) -> None:
        self._table = table
        self._functions = functions
        self._nests = nests
        self._nesting = nesting
        self._states = [0]
        self._parts: list[Part] = []

    def takes(self, kind: str) -> bool:
        """Return whether a token of this kind may come next."""
        return self._ahead(kind) is not REFUSED

    def expected(self) -> frozenset[str]:
        """Kinds of the tokens that may come next."""
        row = self._table.actions[self._states[-1]]
        return frozenset(kind for kind in (*row, END) if self.takes(kind))

    def feed(self, kind: str, value: object, span: Span) -> bool:
        """Take a token if it may come next, and return True; otherwise return False.

        Raises:
            TooDeepError: the text is nested more deeply than allowed.
        """
        ahead = self._ahead(kind)
        if ahead is REFUSED:
            return False
        self._reduce(ahead)
        self._states.append(ahead.state)
        self._parts.append(Part(value, span, 0))
        return True

    def finish(self) -> object:
        """Value of the complete text; the end must be allowed next."""
        self._reduce(self._ahead(END))
        return self._parts[0].value

    def _ahead(self, kind: str) -> Ahead:
        """Effects of a token, by simulation of all its reductions; ``REFUSED`` if it is not allowed next."""
        table, states = self._table, self._states
        actions, gotos, rules = table.actions, table.gotos, table.rules
        below, state = len(states), states[-1]
        above: list[int] = []
        reduced: list[Rule] = []
        while True:
            action = actions[state].get(kind)
            if action is None:
                if kind != END or state != table.accept:
                    return REFUSED
                return Ahead(state, reduced, below, above)
            if action >= 0:
                return Ahead(action, reduced, below, above)
            rule = rules[-1 - action]
            for _ in range(rule.size):
                if above:
                    above.pop()
                else:
                    below -= 1
            state = gotos[above[-1] if above else states[below - 1]][rule.symbol]
            above.append(state)
            if rule.name:
                reduced.append(rule)

    def _reduce(self, ahead: Ahead) -> None:
        if not ahead.above:
            return
        self._states[ahead.below :] = ahead.above
        parts = self._parts
        for rule in ahead.rules:
            size = rule.size
            if size == 1:
                part = parts[-1]
                parts[-1] = self._part(rule, parts[-1:], part.span, part.depth)
            else:
                merged = parts[-size:]
                depth = max([part.depth for part in merged])
                parts[-size:] = [self._part(rule, merged, merged[0].span.to(merged[-1].span), depth)]

    def _part(self, rule: Rule, parts: list[Part], span: Span, depth: int) -> Part:
        if rule.name in self._nests:
            depth += 1
            if depth > self._nesting:
                raise TooDeepError(next(part for part in parts if part.depth == 0 or part is parts[-1]))
        arguments: list[object] = []
        for place in rule.keep:
            value = None if place < 0 else parts[place].value
            if not isinstance(value, list):
                arguments.append(value)
            elif arguments:
                arguments.extend(value)
            else:
                arguments = value  # a list that grows by one item each time, without copies
        return Part(arguments if rule.name == "*" else self._functions[rule.name](span, *arguments), span, depth)


Outcome: TypeAlias = "ast.Declaration | Diagnostic"


def parse(source: Source, limits: Limits, load: Loader) -> tuple[ast.Program | None, list[Diagnostic]]:
    """Syntax tree of a text, or None and all errors in file order.

    Args:
        load: function that reads included files.
    """
    declarations, findings = read(source, limits, load)
    if not declarations and not findings:
        findings = [_empty(source)]
    if findings:
        return None, findings[:MOST_FINDINGS]
    return ast.Program(Span(source, 0, len(source.text)), tuple(declarations)), []


def read(source: Source, limits: Limits, load: Loader) -> tuple[list[ast.Declaration], list[Diagnostic]]:
    """Valid declarations of a text, with those of included files in place of each ``include``, and all errors."""
    return _Reader(limits, load, {source.name: Span(source, 0, 0)}, Files(limits, load)).read(source, ())


def read_passage(passage: Span, limits: Limits) -> tuple[list[Outcome], list[Diagnostic]]:
    """Declarations of a passage, an error for each invalid one, and errors about single tokens."""
    tokens, odd = tokenise(passage, limits)
    outcomes = _read_declarations(tokens, 0, passage.end, limits)
    if any(isinstance(outcome, Diagnostic) for outcome in outcomes):
        # Messages about an error also refer to the words around the passage.
        tokens, _ = tokenise(_with_neighbours(passage), limits)
        first = next(at for at, token in enumerate(tokens) if token.span.start >= passage.start)
        outcomes = _read_declarations(tokens, first, passage.end, limits)
    return outcomes, odd


class _Reader(Record):
    """Parser of a file and the files that it includes.

    ``read_already`` has the span at which each file was first included; ``sizes`` are in bytes.
    """

    limits: Limits
    load: Loader
    read_already: dict[str, Span]
    files: Files
    sizes: list[int] = field(default_factory=list)

    def read(self, source: Source, chain: tuple[Span, ...]) -> tuple[list[ast.Declaration], list[Diagnostic]]:
        """Declarations and errors of a file and the files that it includes.

        Args:
            chain: spans of the includes that lead to the file.
        """
        self.sizes.append(len(source.text.encode("utf-8", "replace")))
        if sum(self.sizes) > self.limits.file_bytes:
            return [], [_too_large(source, self.sizes, chain, self.limits)]
        declarations: list[ast.Declaration] = []
        findings: list[Diagnostic] = []
        for passage in passages(source):
            outcomes, odd = read_passage(passage, self.limits)
            parsed, wrong = self._followed(outcomes, odd, source, chain)
            declarations += parsed
            findings += wrong
            if len(findings) >= MOST_FINDINGS:
                break
        return declarations, findings

    def _followed(
        self, outcomes: list[Outcome], odd: list[Diagnostic], source: Source, chain: tuple[Span, ...]
    ) -> tuple[list[ast.Declaration], list[Diagnostic]]:
        """Declarations of a passage and of the files that it includes, and errors in the order of the text."""
        declarations: list[ast.Declaration] = []
        findings = [(_start(finding), finding) for finding in odd]
        for outcome in outcomes:
            match outcome:
                case Diagnostic():
                    findings.append((_start(outcome), outcome))
                case ast.Include():
                    included, more = self._follow(outcome, source, chain)
                    declarations += included
                    findings += [(outcome.span.start, finding) for finding in more]
                case ast.Solve(files=files) if files:
                    read = [self._with_source(each, source, chain) for each in files]
                    findings += [(outcome.span.start, each) for each in read if isinstance(each, Diagnostic)]
                    found = tuple(each for each in read if isinstance(each, ast.FileSetting))
                    declarations.append(replace(outcome, files=found))
                case _:
                    whole, more = self.files.read(outcome)
                    declarations.append(whole)
                    findings += [(outcome.span.start, finding) for finding in more]
        findings.sort(key=lambda pair: pair[0])
        return declarations, [finding for _, finding in findings]

    def _with_source(
        self, setting: ast.FileSetting, source: Source, chain: tuple[Span, ...]
    ) -> ast.FileSetting | Diagnostic:
        """The setting with the content of its file, or an error.

        A link is followed once, and the total size is limited.
        """
        loaded = self.load(setting.path, setting.span)
        if isinstance(loaded, Source) and (link := LINK.fullmatch(loaded.text)):
            loaded = self.load(link[1], Span(loaded, 0, len(loaded.text)))
        if isinstance(loaded, Diagnostic):
            return loaded
        self.sizes.append(len(loaded.text.encode("utf-8", "replace")))
        if sum(self.sizes) > self.limits.file_bytes:
            return _too_large(loaded, self.sizes, (*chain, setting.span), self.limits)
        return replace(setting, source=loaded)

    def _follow(
        self, include: ast.Include, source: Source, chain: tuple[Span, ...]
    ) -> tuple[list[ast.Declaration], list[Diagnostic]]:
        loaded = self.load(include.path, include.span)
        chain = (*chain, include.span)
        match loaded:
            case Diagnostic():
                return [], [loaded]
            case Source(name) if name == source.name or name in [span.source.name for span in chain]:
                return [], [_cycle(name, chain)]
            case Source(name) if name in self.read_already:
                return [], [_included_twice(name, include, self.read_already[name])]
            case Source() if len(chain) > self.limits.include_depth:
                return [], [_includes_too_deep(chain, self.limits)]
            case Source(name):
                self.read_already[name] = include.span
                return self.read(loaded, chain)


def _with_neighbours(passage: Span) -> Span:
    """Span from the beginning of the previous passage to the end of the next one."""
    cuts = list(passages(passage.source))
    here = cuts.index(passage)
    return cuts[max(here - 1, 0)].to(cuts[min(here + 1, len(cuts) - 1)])


def _read_declarations(tokens: Sequence[Token], here: int, end: int, limits: Limits) -> list[Outcome]:
    """Declarations that begin at or after the token ``here``, and before the character ``end``, or an error for
    each.
    """
    outcomes: list[Outcome] = []
    wrong = 0
    while tokens[here].kind != END and tokens[here].span.start < end and wrong < MOST_FINDINGS:
        outcome, here = _read_declaration(tokens, here, limits)
        outcomes.append(outcome)
        wrong += isinstance(outcome, Diagnostic)
    return outcomes


def _read_declaration(tokens: Sequence[Token], first: int, limits: Limits) -> tuple[ast.Declaration | Diagnostic, int]:
    """Declaration that starts at a token, or its error, and the index of the token after it."""
    machine = Machine(parse_table.load(), functions(), NESTS, limits.nesting)
    opened: list[int] = []
    here = first
    try:
        while True:
            token = tokens[here]
            ends = here > first and (token.kind == END or token.declares)
            if ends or not feed(machine, token):
                # Whatever starts a line after a whole declaration belongs to the next one.
                if here > first and (ends or token.starts_line) and machine.takes(END):
                    return cast(ast.Declaration, machine.finish()), here
                place = Place(tokens, first, here, machine.expected(), tuple(opened))
                return explain(place), _next_start(tokens, first, here)
            if token.kind in _OPENING:
                opened.append(here)
                if len(opened) > limits.nesting:
                    return _too_deep(token.span, limits), _next_start(tokens, first, here)
            elif token.kind in _CLOSING:
                opened.pop()
            here += 1
    except MisreadError as misread:
        return misread.finding, _next_start(tokens, first, here)
    except TooDeepError as deep:
        return _too_deep(deep.part.span, limits), _next_start(tokens, first, here)


_NAMES = frozenset({NAME, LABEL})
_OPENING = frozenset("([{")
_CLOSING = frozenset(")]}")


def feed(machine: Machine, token: Token) -> bool:
    """Give a token to the parser, by its own kind or else as a name; return whether it was allowed."""
    if token.kind in _NAMES:
        return machine.feed(token.kind, ast.Name(token.span, token.text), token.span)
    if machine.feed(token.kind, token, token.span):
        return True
    return token.may_be_name and machine.feed(NAME, ast.Name(token.span, token.text), token.span)


def _next_start(tokens: Sequence[Token], first: int, here: int) -> int:
    """Index of the token at which parsing continues after an error: a word that probably starts a declaration."""
    here = max(here, first + 1)
    while tokens[here].kind != END:
        if tokens[here].declares and (
            tokens[here].starts_line or (tokens[here + 1].kind == NAME and tokens[here + 2].kind in ("=", "[", "{"))
        ):
            break
        here += 1
    return here


# ------------------------------------------------------------------ messages


def _start(finding: Diagnostic) -> int:
    return finding.primary.span.start if finding.primary else 0


def _empty(source: Source) -> Diagnostic:
    return Diagnostic(
        codes.EMPTY,
        "the mission is empty: the file has no declaration",
        Label(Span(source, 0, 0)),
        help="start with `mission NAME`, as `missionc explain MC003` shows",
    )


def _too_large(source: Source, sizes: list[int], chain: tuple[Span, ...], limits: Limits) -> Diagnostic:
    total = sum(sizes)
    one = f"the file has {total} bytes"
    many = f"with `{source.name}`, the {len(sizes)} files of the mission have {total} bytes"
    return Diagnostic(
        codes.FILE_TOO_LARGE,
        f"{many if chain else one}; the limit is {limits.file_bytes}",
        Label(chain[-1] if chain else Span(source, 0, 0)),
        help=f"raise the limit with `--limit file_bytes={total}`",
    )


def _too_deep(span: Span, limits: Limits) -> Diagnostic:
    raised = min(2 * limits.nesting, DEEPEST)
    can_raise = raised > limits.nesting
    return Diagnostic(
        codes.NESTED_TOO_DEEP,
        f"nested more than {limits.nesting} deep",
        Label(span),
        help=f"raise the limit with `--limit nesting={raised}`" if can_raise else "name the inner part with `let`",
    )


def _cycle(name: str, chain: tuple[Span, ...]) -> Diagnostic:
    files = [span.source.name for span in chain]
    files = files[files.index(name) :]
    steps = chain[len(chain) - len(files) :]
    if len(files) == 1:
        return Diagnostic(
            codes.INCLUDE_CYCLE, f"`{name}` includes itself", Label(steps[-1]), help="delete this `include`"
        )
    return Diagnostic(
        codes.INCLUDE_CYCLE,
        f"`{name}` includes itself through {', '.join(f'`{file}`' for file in files[1:])}",
        Label(steps[-1], f"`{name}` again"),
        tuple(Label(step, f"`{file}` is included here") for step, file in zip(steps, files[1:], strict=False)),
        help="delete one of these includes",
    )


def _included_twice(name: str, include: ast.Include, first: Span) -> Diagnostic:
    return Diagnostic(
        codes.DECLARED_AGAIN,
        f"`{name}` is included twice",
        Label(include.span),
        (Label(first, "first included here"),),
        help="delete one of the two includes",
    )


def _includes_too_deep(chain: tuple[Span, ...], limits: Limits) -> Diagnostic:
    return Diagnostic(
        codes.INCLUDE_TOO_DEEP,
        f"includes are nested {len(chain)} deep; the limit is {limits.include_depth}",
        Label(chain[-1]),
        help=f"raise the limit with `--limit include_depth={len(chain)}`",
    )
