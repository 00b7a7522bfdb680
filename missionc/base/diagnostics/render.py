"""Renderers of diagnostics: text for people, and plain values for programs.

    in   Diagnostic
    out  text in the style of rustc, or plain dictionaries

A span over several lines is underlined on its first line only. Columns are terminal columns: a tab counts four, a wide
character two, a combining character none. Control characters are escaped (``sanitize``).

Sanitizing of untrusted text (a mission, a file name, an option) before it is printed on a terminal.

A terminal interprets control characters: they move its cursor, change its title, or reverse the text direction. These
characters are escaped as in Python, ``\x1b``; in JSON output they have JSON escapes.
"""

from __future__ import annotations

import json
import re
import textwrap
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Protocol

from missionc.base.diagnostics.code import Code, Severity
from missionc.base.late_dataclass import Record
from missionc.base.source import Source, Span

UNUSUAL = re.compile(r"[^\t\n\x20-\x7e]")

ACTED_ON = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Escaped Unicode categories: control and format characters, surrogates, line and paragraph separators."""


def plain(text: str) -> str:
    """Text with all control characters except line ends and tabs escaped."""
    return UNUSUAL.sub(lambda match: _written(match[0]), text)


def plain_line(text: str) -> str:
    """Text with all control characters, line ends included, escaped; for single lines such as a file name."""
    return plain(text).replace("\n", "\\n")


def as_json(document: object) -> str:
    """Document as indented JSON, with control characters in strings escaped.

    Raises:
        ValueError: the document contains an infinite number or NaN.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return UNUSUAL.sub(lambda match: json.dumps(match[0])[1:-1] if _acted_on(match[0]) else match[0], text)


def _written(letter: str) -> str:
    if not _acted_on(letter):
        return letter
    return letter.encode("unicode_escape").decode("ascii")


def _acted_on(letter: str) -> bool:
    return unicodedata.category(letter) in ACTED_ON


TAB = 4
LONGEST = 140
"""Maximum number of characters of a source line in a message; longer lines are truncated."""
BEFORE = 30
"""Number of characters before the first label that remain in a truncated source line."""

LEAST_WIDTH = 20
"""Minimum width of wrapped text on a narrow terminal, columns."""

RED, YELLOW, BLUE, CYAN, BOLD = "31;1", "33;1", "34;1", "36;1", "1"


class Label(Protocol):
    """Interface of a label: source location with a message about it."""

    @property
    def span(self) -> Span: ...

    @property
    def message(self) -> str: ...


class Finding(Protocol):
    """Interface of a finding: the attributes of a ``Diagnostic`` that the renderers read."""

    @property
    def code(self) -> Code: ...

    @property
    def severity(self) -> Severity: ...

    @property
    def message(self) -> str: ...

    @property
    def primary(self) -> Label | None: ...

    @property
    def labels(self) -> Sequence[Label]: ...

    @property
    def notes(self) -> Sequence[str]: ...

    @property
    def help(self) -> str: ...


class Mark(Record):
    """Underline of a source line with its message, from column ``start`` to column ``end`` (exclusive) of the
    terminal."""

    start: int
    end: int
    primary: bool
    message: str


class Paint(Record):
    """Colours for words of a rendered finding; ``colour`` False disables colours."""

    colour: bool
    severity: str

    def __call__(self, style: str, text: str) -> str:
        return f"\x1b[{style}m{text}\x1b[0m" if self.colour and text else text

    def style(self, mark: Mark) -> str:
        return self.severity if mark.primary else BLUE


def render_text(findings: Sequence[Finding], colour: bool, width: int = 0) -> str:
    """Findings as text for people, separated by blank lines; each finding ends with a line end.

    Args:
        colour: colour the text with terminal escape codes.
        width: column at which sentences are wrapped and source lines are truncated; 0 for no limit.
    """
    return "\n".join(_finding(finding, colour, width) for finding in findings)


def wrapped(text: str, width: int, indent: int, first: int = 0) -> str:
    """Line of text wrapped at ``width`` columns, with continuation lines indented; unchanged if ``width`` is 0.

    Args:
        indent: columns of indentation of continuation lines.
        first: columns of the first line that other text occupies.
    """
    if not width or len(text) + first <= width:
        return text
    lines = textwrap.wrap(
        text,
        max(width, indent + LEAST_WIDTH),
        initial_indent=" " * first,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines)[first:]


def counts(findings: Iterable[Finding]) -> str:
    """Numbers of errors and warnings as text: ``2 errors, 1 warning``."""
    severities = [finding.severity for finding in findings]
    parts = [
        f"{number} {severity.value}{'s' if number > 1 else ''}"
        for severity in Severity
        if (number := severities.count(severity))
    ]
    return ", ".join(parts) or "no findings"


def render_json(findings: Sequence[Finding]) -> list[dict[str, object]]:
    """Findings as plain values for JSON; lines and columns are counted from 1, and ``end_column`` is exclusive."""
    return [
        {
            "code": finding.code.name,
            "severity": finding.severity.value,
            "message": finding.message,
            **_place(finding.primary.span if finding.primary else None),
            "labels": [{"message": label.message, **_place(label.span)} for label in _labels(finding)],
            "notes": list(finding.notes),
            "help": finding.help,
        }
        for finding in findings
    ]


def _labels(finding: Finding) -> list[Label]:
    """Labels of a finding, the primary one only if it has a message."""
    primary = [finding.primary] if finding.primary and finding.primary.message else []
    return [*primary, *finding.labels]


def _place(span: Span | None) -> dict[str, object]:
    if span is None:
        return dict.fromkeys(("file", "line", "column", "end_line", "end_column"))
    line, column = span.source.place(span.start)
    end_line, end_column = span.source.place(span.end)
    return {
        "file": span.source.name,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
    }


def _finding(finding: Finding, colour: bool, width: int) -> str:
    paint = Paint(colour, RED if finding.severity is Severity.ERROR else YELLOW)
    head = f"{finding.severity.value}[{finding.code.name}]"
    message = wrapped(": " + plain(finding.message), width, 2, len(head))
    lines = [f"{paint(paint.severity, head)}{paint(BOLD, message)}"]
    labels = [*([finding.primary] if finding.primary else []), *finding.labels]
    numbers = [label.span.source.place(label.span.start)[0] for label in labels]
    gutter = max((len(str(number)) for number in numbers), default=1)
    longest = min(LONGEST, max(width - gutter - 3, LEAST_WIDTH)) if width else LONGEST
    lines.extend(_snippets(finding, labels, gutter, longest, paint))
    lines.extend(_hanging(" " * (gutter + 1) + paint(BLUE, "="), gutter + 3, note, width) for note in finding.notes)
    if finding.help:
        lines.append(_hanging(" " * (gutter + 1) + paint(CYAN, "help:"), gutter + 7, finding.help, width))
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _hanging(head: str, indent: int, text: str, width: int) -> str:
    """Text after a head, with continuation lines indented by ``indent`` columns and wrapped at ``width`` columns."""
    lines = [wrapped(line, width, indent, indent) for line in plain(text).split("\n")]
    return f"{head} " + ("\n" + " " * indent).join(lines)


def _snippets(finding: Finding, labels: list[Label], gutter: int, longest: int, paint: Paint) -> list[str]:
    """Source excerpts of a finding: for each file, a line with its name, then the labelled source lines in order."""
    by_source: dict[str, list[Label]] = {}
    for label in labels:
        by_source.setdefault(label.span.source.name, []).append(label)
    lines = []
    for number, here in enumerate(by_source.values()):
        line, column = here[0].span.source.place(here[0].span.start)
        arrow = "-->" if number == 0 else ":::"
        lines.append(f"{' ' * gutter}{paint(BLUE, arrow)} {plain_line(here[0].span.source.name)}:{line}:{column}")
        lines.extend(_source_lines(here[0].span.source, here, finding.primary, gutter, longest, paint))
    return lines


def _source_lines(
    source: Source, labels: list[Label], primary: Label | None, gutter: int, longest: int, paint: Paint
) -> list[str]:
    by_line: dict[int, list[Label]] = {}
    for label in labels:
        by_line.setdefault(source.place(label.span.start)[0], []).append(label)
    lines: list[str] = []
    previous = None
    for number in sorted(by_line):
        if previous is not None and number == previous + 2:
            shown, _ = _cells(_excerpt(source.line(previous + 1), 0, longest)[1])
            lines.append(f"{paint(BLUE, f'{previous + 1:>{gutter}} |')} {shown}")
        elif previous is not None and number > previous + 2:
            lines.append(paint(BLUE, "..."))
        lines.extend(_marked(source, number, by_line[number], primary, gutter, longest, paint))
        previous = number
    return lines


def _marked(
    source: Source, number: int, labels: list[Label], primary: Label | None, gutter: int, longest: int, paint: Paint
) -> list[str]:
    """Source line, followed by lines with its underlines and their messages."""
    text = source.line(number)
    begin = source.line_starts[number - 1]
    cut, excerpt = _excerpt(text, min(label.span.start for label in labels) - begin, longest)
    shown, columns = _cells(excerpt)

    def column(offset: int) -> int:
        return columns[max(0, min(offset - begin - cut, len(excerpt)))]

    marks = [
        Mark(
            column(label.span.start),
            max(column(label.span.end), column(label.span.start) + 1),
            label is primary,
            plain(label.message),
        )
        for label in labels
    ]
    lines = [f"{paint(BLUE, f'{number:>{gutter}} |')} {shown}"]
    lines.extend(f"{' ' * (gutter + 1)}{paint(BLUE, '|')} {line}" for line in _underline(marks, paint))
    return lines


def _underline(marks: list[Mark], paint: Paint) -> list[str]:
    """Lines with the underlines of one source line: the rightmost message follows its underline, the other messages
    hang below, from right to left."""
    width = max(mark.end for mark in marks)
    row = [" "] * width
    for mark in sorted(marks, key=lambda mark: mark.primary):
        row[mark.start : mark.end] = ("^" if mark.primary else "-") * (mark.end - mark.start)
    styles = {"^": paint.severity, "-": BLUE}
    runs = ("".join(run) for _, run in groupby(row))
    first = "".join(paint(styles[run[0]], run) if run[0] in styles else run for run in runs)
    hanging = sorted((mark for mark in marks if mark.message), key=lambda mark: (mark.start, mark.end))
    if hanging and all(mark.end <= hanging[-1].start for mark in marks if mark is not hanging[-1]):
        last = hanging.pop()
        first += " " + paint(paint.style(last), last.message)
    lines = [first]
    while hanging:
        mark = hanging.pop()
        stems = {other.start: paint(paint.style(other), "|") for other in hanging if other.start < mark.start}
        before = "".join(stems.get(place, " ") for place in range(mark.start))
        lines.append(before + paint(paint.style(mark), mark.message))
    return lines


def _excerpt(text: str, first: int, longest: int) -> tuple[int, str]:
    """Offset and text of the part of a source line that is displayed, at most ``longest`` characters."""
    if len(text) <= longest:
        return 0, text
    cut = max(0, min(first - BEFORE, len(text) - longest))
    part = text[cut : cut + longest]
    if cut > 0:
        part = "…" + part[1:]
    return cut, part if cut + longest >= len(text) else part[:-1] + "…"


def _cells(text: str) -> tuple[str, list[int]]:
    """Source text as displayed, and the terminal column of each character and of the end of the text."""
    shown: list[str] = []
    columns = [0]
    for letter in text:
        cell = " " * (TAB - columns[-1] % TAB) if letter == "\t" else plain(letter)
        shown.append(cell)
        columns.append(columns[-1] + sum(map(_width, cell)))
    return "".join(shown), columns


def _width(letter: str) -> int:
    if unicodedata.combining(letter):
        return 0
    return 2 if unicodedata.east_asian_width(letter) in "WF" else 1
