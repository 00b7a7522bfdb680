"""Origins of findings: maps from the text of a mission built in Python to the expressions that built each part.

in   findings about the text, the mission
out  the same findings at the lines of Python, each with its location in the text as well
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import TypeAlias

from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Source, Span
from missionc.frontend.builder.mission import Mission, read_declarations

MissionLike: TypeAlias = "str | Path | Source | Mission"
"""Path of a file, a text with a name, or a mission built in Python."""


def source_of(mission: MissionLike) -> str | Path | Source:
    """The mission in the form that the front end reads: a path or a text.

    Raises:
        TypeError: the value is not a mission.
    """
    if isinstance(mission, str | Path | Source):
        return mission
    if isinstance(mission, Mission):
        return mission.source
    raise TypeError(f"expected a path, a Source or a Mission, found {mission!r}")


def at_origins(findings: Iterable[Diagnostic], mission: MissionLike) -> tuple[Diagnostic, ...]:
    """Findings about the text of a mission, moved to the Python expression that built each part.

    Other findings stay unchanged.
    """
    listed = tuple(findings)
    if not isinstance(mission, Mission) or not any(finding.primary for finding in listed):
        return listed
    origin = _origins(mission)
    return tuple(_moved(finding, origin) for finding in listed)


def _moved(finding: Diagnostic, origin: Callable[[Span], Span]) -> Diagnostic:
    if finding.primary is None:
        return finding
    place = origin(finding.primary.span)
    labels = tuple(replace(label, span=origin(label.span)) for label in finding.labels)
    if place is not finding.primary.span:
        labels = (*labels, Label(finding.primary.span, "in the text of the mission"))
    return replace(finding, primary=replace(finding.primary, span=place), labels=labels)


def _origins(mission: Mission) -> Callable[[Span], Span]:
    """Function from a span of the mission's text to the span of the Python expression that built the smallest enclosing
    part.
    """
    source = mission.source
    places = [
        (printed, made) for printed, made in _pairs(mission.declarations, read_declarations(source)) if made.source.text
    ]

    def origin(span: Span) -> Span:
        if (span.source.name, span.source.text) != (source.name, source.text):
            return span
        around = [each for each in places if each[0].start <= span.start and span.end <= each[0].end]
        return min(around, key=lambda each: each[0].end - each[0].start, default=(span, span))[1]

    return origin


def _pairs(made: object, printed: object) -> Iterator[tuple[Span, Span]]:
    """Yield the spans of each part, in the text and in Python, from two trees that differ only in spans."""
    waiting = [(made, printed)]
    while waiting:
        one, other = waiting.pop()
        if isinstance(one, Span) and isinstance(other, Span):
            yield other, one
        elif isinstance(one, tuple | list) and isinstance(other, tuple | list):
            waiting += zip(one, other, strict=False)
        elif is_dataclass(one) and not isinstance(one, type | Source):
            waiting += ((getattr(one, each.name), getattr(other, each.name, None)) for each in fields(one))
