"""Answer to one run of a sweep: its outcome and a value for each column, as one line of JSON.

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
"""Outcome of a run that ended abnormally: a defect of the compiler, or a dead process."""
OUTCOMES = ("planned", "impossible", "undecided", "unverified", "refused", ERROR)
"""All outcomes; ``refused`` means that the input is invalid."""

Value: TypeAlias = str | int | float | None


@dataclass(frozen=True, slots=True)
class RunResult:
    """Result of a run.

    Args:
        outcome: one of ``OUTCOMES``.
        values: other columns of the table by name; None for missing values.
        sizes: sizes of the solved problem, by name.
        files: files of its plan, if they are stored.
    """

    outcome: str
    values: Mapping[str, Value]
    sizes: Mapping[str, int] = field(default_factory=dict)
    files: tuple[tuple[str, bytes], ...] = ()


def one_line(document: Mapping[str, Any]) -> str:
    """JSON text of a document on one line."""
    return json.dumps(document, ensure_ascii=True, allow_nan=False, separators=(",", ":"))


def sent(files: Mapping[str, bytes]) -> dict[str, str]:
    """File contents by name, base64-encoded for a JSON document."""
    return {name: base64.b64encode(content).decode("ascii") for name, content in files.items()}


def received(files: Mapping[str, str]) -> dict[str, bytes]:
    """File contents by name, decoded from ``sent``.

    Raises:
        ValueError: a text is not an encoded file.
    """
    return {name: base64.b64decode(content, validate=True) for name, content in files.items()}


SCHEMA = "missionc.answer/1"


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of a run, or a refusal by a worker with other versions.

    Args:
        result: result of the run.
        host: machine that answered.
        versions: versions of the worker that refused; otherwise empty.
    """

    result: RunResult
    host: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)


@cache
def versions_here() -> dict[str, str]:
    """Versions of the interpreter and of all packages that may change a result, by name."""
    return {**versions(), "python": platform.python_version()}


def run_answer_text(result: RunResult) -> str:
    """Text of a run's result, on one line."""
    files = sent({name: zlib.compress(content) for name, content in result.files})
    return _text(
        {"outcome": result.outcome, "values": dict(result.values), "sizes": dict(result.sizes), "files": files}
    )


def failed(why: str) -> str:
    """Text of an answer for a run that ended abnormally, for a reason in words."""
    return _text({"outcome": ERROR, "values": {"says": why}, "sizes": {}, "files": {}})


def other_versions(here: Mapping[str, str]) -> str:
    """Text of a worker's refusal, with its own versions, which differ from those requested."""
    return _text({"outcome": ERROR, "values": {}, "sizes": {}, "files": {}, "versions": dict(here)})


def with_usage(text: str, seconds: float, size: int) -> str:
    """Text of an answer with the resource usage of its process.

    Args:
        text: text of the answer.
        seconds: processor time, s.
        size: maximum memory, bytes.
    """
    document = parse_record(text, SCHEMA)
    document["values"] |= {"cpu_seconds": round(seconds, 4), "peak_bytes": size}
    return one_line(document)


def read_run_answer(text: str) -> Answer:
    """Parse the text of an answer.

    Raises:
        ValueError, KeyError, TypeError: the text is not an answer.
    """
    document = parse_record(text, SCHEMA)
    files = tuple((name, zlib.decompress(each)) for name, each in received(document["files"]).items())
    values: dict[str, Value] = dict(document["values"])
    result = RunResult(document["outcome"], values, document["sizes"], files)
    return Answer(result, document["host"], document.get("versions", {}))


def _text(document: dict[str, Any]) -> str:
    return one_line({"schema": SCHEMA, "host": platform.node(), **document})
