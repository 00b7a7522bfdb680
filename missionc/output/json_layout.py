"""JSON layout that people can read too: records over several lines, their values on one."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping


def compact(value: object) -> str:
    """On one line; doubles in the shortest form that reads back the same."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def document(head: Mapping[str, object], *entries: str) -> str:
    """A whole text: the entries of ``head``, one a line, then ``entries`` that are JSON already."""
    lines = [f"  {compact(key)}: {compact(value)}" for key, value in head.items()]
    return "{\n" + ",\n".join([*lines, *entries]) + "\n}\n"


def listed(key: str, entries: Iterable[str]) -> str:
    """An entry of the outermost record whose value is a list, a line for each; ``entries`` are JSON already."""
    rows = ",\n".join(f"    {entry}" for entry in entries)
    return f"  {compact(key)}: [\n{rows}\n  ]" if rows else f"  {compact(key)}: []"


def record(entries: Mapping[str, object], depth: int) -> str:
    """One line for each entry, ``depth`` levels in."""
    if not entries:
        return "{}"
    inner, outer = "  " * (depth + 1), "  " * depth
    lines = (f"{inner}{compact(key)}: {compact(value)}" for key, value in entries.items())
    return "{\n" + ",\n".join(lines) + f"\n{outer}}}"
