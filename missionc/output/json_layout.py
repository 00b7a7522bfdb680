"""Readable JSON layout: records over several lines, each value on one line."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping


def compact(value: object) -> str:
    """JSON text of a value on one line, with doubles in the shortest form that reads back the same."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def document(head: Mapping[str, object], *entries: str) -> str:
    """JSON text of a document: the entries of ``head`` on one line each, then ``entries``, which are JSON already."""
    lines = [f"  {compact(key)}: {compact(value)}" for key, value in head.items()]
    return "{\n" + ",\n".join([*lines, *entries]) + "\n}\n"


def listed(key: str, entries: Iterable[str]) -> str:
    """Entry of the outermost record with a list as its value, one item on each line; ``entries`` are JSON already."""
    rows = ",\n".join(f"    {entry}" for entry in entries)
    return f"  {compact(key)}: [\n{rows}\n  ]" if rows else f"  {compact(key)}: []"


def record(entries: Mapping[str, object], depth: int) -> str:
    """JSON text of a record with one line for each entry, at nesting level ``depth``."""
    if not entries:
        return "{}"
    inner, outer = "  " * (depth + 1), "  " * depth
    lines = (f"{inner}{compact(key)}: {compact(value)}" for key, value in entries.items())
    return "{\n" + ",\n".join(lines) + f"\n{outer}}}"
