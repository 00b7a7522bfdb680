"""Map errors: findings about a file of positions or samples, raised by the reader of the file."""

from __future__ import annotations

from missionc.base.diagnostics.code import FILE_TOO_LARGE, MAP_FEATURE, MAP_OPTION, MAP_UNREADABLE, Code
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.limits import MOST, Limits
from missionc.base.source import Source, Span


class MapError(Exception):
    """Error for a map file, or a part of one, that cannot be used."""

    def __init__(self, code: Code, message: str, span: Span, way_out: str) -> None:
        super().__init__(message)
        self.finding = Diagnostic(code, message, Label(span), help=way_out)


def unreadable(source: Source, reason: str, span: Span, way_out: str) -> MapError:
    return MapError(MAP_UNREADABLE, f"`{source.name}` cannot be read: {reason}", span, way_out)


def unusable(reason: str, span: Span, way_out: str) -> MapError:
    return MapError(MAP_FEATURE, reason, span, way_out)


def unsaid(message: str, span: Span, way_out: str) -> MapError:
    return MapError(MAP_OPTION, message, span, way_out)


def too_many(source: Source, what: str, name: str, count: int, limits: Limits, span: Span) -> MapError:
    if count > MOST:
        message = f"`{source.name}` has more than {MOST} {what}; the limit is {getattr(limits, name)}"
        return MapError(FILE_TOO_LARGE, message, span, "use a smaller file")
    message = f"`{source.name}` has {count} {what}; the limit is {getattr(limits, name)}"
    return MapError(FILE_TOO_LARGE, message, span, f"raise the limit with `--limit {name}={count}`")
