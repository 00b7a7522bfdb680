"""The formatter for the standard layout of missions: it changes white space and line ends, not words or comments.

in   Source of a mission without errors of syntax, its Program
out  its text

Each declaration begins a new line. Line ends inside a declaration stay, and so does one empty line between two
declarations. Adjacent lines of one kind are a table: their names, labels, `=` signs and comments are aligned.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from itertools import groupby

from missionc.base.late_dataclass import dataclass
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse_table import END
from missionc.frontend.syntax.tokens import EXTREME, LABEL, NAME, NUMBER, UNIT, Token, tokenise

INDENT, FURTHER = 2, 2
"""Indentation in columns: inside braces, and of continuation lines of a declaration."""

TABLES: tuple[tuple[str, ...], ...] = (
    ("region", "obstacle", "beacon"),
    ("obstacles", "regions", "beacons"),
    ("time", "world"),
    ("require", "prefer"),
    ("graph", "formation"),
    ("separation", "clearance"),
    ("resource", "flag"),
    ("param",),
    ("let",),
    ("group",),
)
"""Declarations whose consecutive lines are aligned as one table."""

COMPARED = frozenset({"<=", ">=", "<", ">", "=", "->", "<->", "&", "|"})
ARITHMETIC = frozenset({"+", "-", "*", "/"})
OPEN, CLOSE = frozenset({"(", "["}), frozenset({")", "]"})
CALLED = frozenset({"start", "finish", "of"})
"""Words after which a name and a bracket are a grid of points, not a function call."""


@dataclass(slots=True)
class _Line:
    """Tokens of one line with the white space before each; the first white space is the indentation."""

    depth: int
    further: bool = False
    tokens: list[Token] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)
    comment: str = ""
    after_empty: bool = False
    item: bool = False

    @property
    def indent(self) -> int:
        return self.depth * INDENT + (FURTHER if self.further else 0)

    def text(self) -> str:
        words = "".join(gap + token.text for gap, token in zip(self.gaps, self.tokens, strict=True))
        return " " * self.indent + words if words else ""


def format_mission(source: Source, program: ast.Program, limits: Limits) -> str:
    """The mission's text in the standard layout; formatting it again changes nothing.

    Args:
        source: text without syntax errors.
        program: its syntax tree.
    """
    tokens, _ = tokenise(Span(source, 0, len(source.text)), limits)
    lines = _lines(source.text, tokens, _items(program))
    for _, run in groupby(lines, key=_Tables()):
        _align(list(run))
    _align_comments(lines)
    written = []
    for number, line in enumerate(lines):
        if line.after_empty and number:
            written.append("")
        text = line.text()
        between = "" if not text else "  "
        head = text if text else " " * line.indent
        written.append((head + between + line.comment).rstrip() if line.comment else text)
    return "\n".join(written) + "\n" if written else ""


def _items(program: ast.Program) -> frozenset[int]:
    """Offsets in the text at which the items of teams, vehicles, resources, flags and graphs begin."""
    starts: set[int] = set()
    for declaration in program.declarations:
        if isinstance(declaration, ast.Resource | ast.Flag):
            parts = declaration.rates if isinstance(declaration, ast.Resource) else declaration.marks
            starts.update(part.span.start for part in parts)
        if isinstance(declaration, ast.Graph):
            starts.update(part.span.start for part in declaration.ranges)
            starts.update(part.span.start for weight in declaration.weights for part in weight.pairs)
        if isinstance(declaration, ast.Team):
            for item in declaration.items:
                starts.add(item.span.start)
                if isinstance(item, ast.Vehicle):
                    starts.update(setting.span.start for setting in item.settings)
                if isinstance(item, ast.Flight):
                    starts.update(part.span.start for part in item.items)
    return frozenset(starts)


def _lines(text: str, tokens: list[Token], items: frozenset[int]) -> list[_Line]:
    """Lines of the layout, to which the tokens and comments are assigned."""
    lines: list[_Line] = []
    braces: list[bool] = []  # whether the contents of each open brace have lines of their own
    brackets, end = 0, 0
    for index, token in enumerate(tokens):
        beside, alone, broken, empty = _between(text[end : token.span.start], bool(lines))
        end = token.span.end
        if beside:
            lines[-1].comment = beside
        if token.kind == "}" and braces:
            spread = braces.pop()
            depth = len(braces)
        else:
            spread = bool(braces) and braces[-1]
            depth = sum(braces)
        for comment, after_empty in alone:
            lines.append(_Line(len(braces) + (token.kind == "}"), comment=comment, after_empty=after_empty))
        if token.kind == END:
            break
        declares = token.declares and not braces and not brackets
        item = token.span.start in items or token.kind == "}"
        own = declares or (spread and item)
        if not lines or own or broken or beside or alone:
            lines.append(_Line(depth if own else sum(braces), further=not own and not declares, after_empty=empty))
            lines[-1].item = own and not declares and token.kind != "}"
        line = lines[-1]
        line.gaps.append(_gap(tokens, index, text, token.span.start in items) if line.tokens else "")
        line.tokens.append(token)
        brackets += (token.kind in OPEN) - (token.kind in CLOSE)
        if token.kind == "{":
            braces.append(_spread(text, tokens, index))
    return lines


def _between(gap: str, started: bool) -> tuple[str, list[tuple[str, bool]], bool, bool]:
    """Comments and line ends between two tokens.

    Args:
        gap: text between the tokens.
        started: False before the first token.

    Returns:
        The comment after the first token; the comments on lines of their own, each with True if an empty line is
        before it; True if a line ends; and True if an empty line is before the second token.
    """
    first, *rest = gap.split("\n")
    beside, alone, empty = first.strip() if started else "", [], False
    for part in rest[:-1] if started else [first, *rest][:-1]:
        words = part.strip()
        if words:
            alone.append((words, empty))
        empty = not words
    if not started and not rest and first.strip():
        alone.append((first.strip(), False))
    if started and rest and rest[-1].strip():  # the text ends in a comment
        alone.append((rest[-1].strip(), empty))
    return beside, alone, bool(rest), empty


def _spread(text: str, tokens: list[Token], index: int) -> bool:
    """Return whether the author wrote the contents of these braces on several lines."""
    depth = 0
    for token in tokens[index:]:
        depth += (token.kind == "{") - (token.kind == "}")
        if depth == 0:
            return "\n" in text[tokens[index].span.start : token.span.start]
    return True


def _gap(tokens: list[Token], index: int, text: str, item: bool) -> str:
    """White space between a token and the token before it on its line."""
    before, token = tokens[index - 1], tokens[index]
    left, right = before.kind, token.kind
    if item:
        return " " if left in ("{", ",") else "  "
    if right in (",", ":") or right in CLOSE or left in OPEN or left == "!":
        return ""
    if right == "..":
        return ""
    if left == "..":
        return "" if right in (NUMBER, NAME, "(", "-") else " "
    if right in ARITHMETIC or left in ARITHMETIC:
        return _as_tight(tokens, index, text)
    if right == "[":
        return "" if left == NAME or before.word or left in CLOSE else " "
    if right == "(":
        called = left in (NAME, EXTREME) or before.word == "distance"
        return "" if called and not (index > 1 and tokens[index - 2].word in CALLED) else " "
    if left == "[" or (left == NUMBER and right == UNIT and token.text.startswith("/")):
        return ""
    return " "


def _as_tight(tokens: list[Token], index: int, text: str) -> str:
    """White space around `+ - * /`, as the author wrote it on both sides or neither; none after a sign."""
    sign = index if tokens[index].kind in ARITHMETIC else index - 1
    left, right = tokens[sign - 1], tokens[sign + 1]
    leads = left.kind in OPEN or left.kind in (",", "..", ":", *ARITHMETIC, *COMPARED) or left.word not in ("", *NAMES)
    if tokens[sign].kind == "-" and leads:
        if index == sign:
            return "" if left.kind in OPEN or left.kind == ".." else " "
        return ""
    room = left.span.end < tokens[sign].span.start or tokens[sign].span.end < right.span.start
    return " " if room else ""


NAMES = ("end", "true", "false")
"""Words after which a `-` is not the sign of a number."""


class _Tables:
    """Keys of lines: adjacent lines with the same key are aligned as a table."""

    def __init__(self) -> None:
        self.number = 0
        self.last: object = None

    def __call__(self, line: _Line) -> int:
        kind: object = None
        if line.tokens and line.item:
            kind = ("item", line.depth)
        elif line.tokens and not line.further and line.depth == 0:
            kind = next((table for table in TABLES if line.tokens[0].word in table), None)
        goes_on = line.further or (line.item and line.tokens[0].text == "}")
        if not goes_on and (kind is None or kind != self.last or line.after_empty):
            self.number += 1
        self.last = self.last if goes_on else kind
        return self.number


def _align(run: list[_Line]) -> None:
    """Align the second words of a table's lines; then the text after a label, or the `=` after a name."""
    rows = [line for line in run if not line.further and len(line.tokens) > 1]
    if len(rows) < 2 or not all(row.item or any(row.tokens[0].word in table for table in TABLES) for row in rows):
        return
    _pad(rows, [1] * len(rows))
    labelled = [(row, 3) for row in rows if row.tokens[1].kind == LABEL and len(row.tokens) > 3]
    named = [(row, place) for row in rows if not row.item and (place := _after_name(row.tokens))]
    for group in (labelled, named):
        _pad([row for row, _ in group], [column for _, column in group])


def _after_name(tokens: list[Token]) -> int:
    """Index of the `=` token after the name that a line declares and its indices; 0 if there is none."""
    place = 2
    if len(tokens) > 2 and tokens[2].kind == "[":
        place = next((at + 1 for at, token in enumerate(tokens) if token.kind == "]"), len(tokens))
    return place if len(tokens) > place and tokens[place].kind == "=" else 0


def _pad(rows: list[_Line], columns: list[int]) -> None:
    """Align the tokens at these indices of their lines in one column."""
    widths = [
        sum(len(gap) + len(token.text) for gap, token in zip(row.gaps[:column], row.tokens[:column], strict=True))
        for row, column in zip(rows, columns, strict=True)
    ]
    widest = max(widths, default=0)
    for row, column, width in zip(rows, columns, widths, strict=True):
        row.gaps[column] = " " * (1 + widest - width)


def _align_comments(lines: Iterable[_Line]) -> None:
    """Align the comments of adjacent lines in one column."""
    run: list[_Line] = []
    for line in [*lines, _Line(0)]:
        if line.tokens and line.comment and not (line.after_empty and run):
            run.append(line)
            continue
        widest = max((len(each.text()) for each in run), default=0)
        for each in run:
            each.comment = " " * (widest - len(each.text())) + each.comment
        run = [line] if line.tokens and line.comment else []
