"""The answer to one run of a sweep, as it goes over the wire: a text in JSON."""

from __future__ import annotations

import platform
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from missionc.base.strict_json import parse_record
from missionc.output.folder.manifest import versions
from missionc.sweep import wire_text
from missionc.sweep.run_result import ERROR, RunResult, Value

SCHEMA = "missionc.answer/1"


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a run, or that a worker with other versions refused it.

    Args:
        host: the machine that answered.
        versions: of the worker that refused; empty where none did.
    """

    result: RunResult
    host: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)


@cache
def versions_here() -> dict[str, str]:
    """The versions of everything that may change a result, of the interpreter too."""
    return {**versions(), "python": platform.python_version()}


def written(result: RunResult) -> str:
    """The text of a result, on one line."""
    files = wire_text.sent({name: zlib.compress(content) for name, content in result.files})
    return _text(
        {"outcome": result.outcome, "values": dict(result.values), "sizes": dict(result.sizes), "files": files}
    )


def failed(why: str) -> str:
    """The answer where no run came to an end by itself."""
    return _text({"outcome": ERROR, "values": {"says": why}, "sizes": {}, "files": {}})


def other_versions(here: Mapping[str, str]) -> str:
    """The answer of a worker whose versions are not those that were asked for."""
    return _text({"outcome": ERROR, "values": {}, "sizes": {}, "files": {}, "versions": dict(here)})


def with_usage(text: str, seconds: float, size: int) -> str:
    """An answer with the processor time that its process took, and the most memory it had, bytes."""
    document = parse_record(text, SCHEMA)
    document["values"] |= {"cpu_seconds": round(seconds, 4), "peak_bytes": size}
    return wire_text.one_line(document)


def read(text: str) -> Answer:
    """The answer in a text.

    Raises:
        ValueError, KeyError, TypeError: the text is none.
    """
    document = parse_record(text, SCHEMA)
    files = tuple((name, zlib.decompress(each)) for name, each in wire_text.received(document["files"]).items())
    values: dict[str, Value] = dict(document["values"])
    result = RunResult(document["outcome"], values, document["sizes"], files)
    return Answer(result, document["host"], document.get("versions", {}))


def _text(document: dict[str, Any]) -> str:
    return wire_text.one_line({"schema": SCHEMA, "host": platform.node(), **document})
