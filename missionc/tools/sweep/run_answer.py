"""The answer to one run of a sweep: its outcome and a value for each column, as one line of JSON.

in   a document, the contents of files
out  one line of ASCII, and back
"""

from __future__ import annotations

import base64
import json
import platform
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeAlias

from missionc.base.strict_json import parse_record
from missionc.output.folder.manifest import versions

ERROR = "error"
"""The outcome of a run that the compiler did not bring to an end: a defect, or a process that did not last."""
OUTCOMES = ("planned", "impossible", "undecided", "unverified", "refused", ERROR)
"""All there are; ``refused`` is input that is wrong."""

Value: TypeAlias = str | int | float | None


@dataclass(frozen=True, slots=True)
class RunResult:
    """What came of a run.

    Args:
        outcome: one of ``OUTCOMES``.
        values: everything else that a table has of it, by the name of the column; None of what there is none of.
        sizes: of what was solved, by name.
        files: of its plan, where they are to be kept.
    """

    outcome: str
    values: Mapping[str, Value]
    sizes: Mapping[str, int] = field(default_factory=dict)
    files: tuple[tuple[str, bytes], ...] = ()


def one_line(document: Mapping[str, Any]) -> str:
    """The text of a document."""
    return json.dumps(document, ensure_ascii=True, allow_nan=False, separators=(",", ":"))


def sent(files: Mapping[str, bytes]) -> dict[str, str]:
    """Files, by their names, as a document holds them."""
    return {name: base64.b64encode(content).decode("ascii") for name, content in files.items()}


def received(files: Mapping[str, str]) -> dict[str, bytes]:
    """Files as ``sent`` has written them.

    Raises:
        ValueError: a text is none of a file.
    """
    return {name: base64.b64decode(content, validate=True) for name, content in files.items()}


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


def run_answer_text(result: RunResult) -> str:
    """The text of a result, on one line."""
    files = sent({name: zlib.compress(content) for name, content in result.files})
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
    return one_line(document)


def read_run_answer(text: str) -> Answer:
    """The answer in a text.

    Raises:
        ValueError, KeyError, TypeError: the text is none.
    """
    document = parse_record(text, SCHEMA)
    files = tuple((name, zlib.decompress(each)) for name, each in received(document["files"]).items())
    values: dict[str, Value] = dict(document["values"])
    result = RunResult(document["outcome"], values, document["sizes"], files)
    return Answer(result, document["host"], document.get("versions", {}))


def _text(document: dict[str, Any]) -> str:
    return one_line({"schema": SCHEMA, "host": platform.node(), **document})
