"""Strict JSON reader: rejects texts that two JSON readers could interpret differently.

No key is duplicated. Every number is finite (unless the caller accepts others) and fits a double or a 64-bit integer.
No half of a surrogate pair stands alone, and the depth of nesting is limited.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from typing import Any, TypeGuard

from missionc.base.limits import Limits

LONGEST_INTEGER = 19
"""Maximum number of digits of an integer, so that it fits into 64 bits."""
CONSTANT = re.compile(r"-?(?:NaN|Infinity)")
"""Number constants outside the JSON standard that some programs write."""

VALUES = Limits().json_values
"""Default maximum number of values in a JSON text."""


class NotJsonError(ValueError):
    """Error for text that is not valid JSON: the reason as a phrase, and the location in the text."""

    def __init__(self, reason: str, place: int = 0) -> None:
        super().__init__(reason)
        self.reason, self.place = reason, place


def parse_json(content: str | bytes, most: int = VALUES, *, finite: bool = True) -> Any:
    """Value that a JSON text, or JSON bytes in UTF-8, contains.

    Args:
        most: maximum number of values in the text, including nested values.
        finite: reject ``NaN`` and ``Infinity``; if False, they are accepted.

    Raises:
        NotJsonError: the text contains no value, an ambiguous value, or too many values.
    """
    try:
        text = content if isinstance(content, str) else content.decode("utf-8")
    except UnicodeDecodeError:
        raise NotJsonError("it is not UTF-8") from None
    count = 1 + text.count(",") + text.count("[") + text.count("{")
    if count > most:
        raise NotJsonError(
            f"it has about {count} values; the limit is {most}; raise it with `--limit json_values={count}`"
        )
    try:
        value = json.loads(text, parse_int=_integer, object_pairs_hook=_record)
        # An unpaired surrogate is not a character, and NaN is not a number: neither could be written again.
        json.dumps(value, ensure_ascii=False, allow_nan=not finite).encode()
    except json.JSONDecodeError as error:
        here = f"unexpected `{text[error.pos]}`" if error.pos < len(text) else "unexpected end of the file"
        raise NotJsonError(f"this is not JSON: {here}", error.pos) from None
    except UnicodeEncodeError:
        raise NotJsonError("a text has an unpaired surrogate") from None
    except RecursionError:
        raise NotJsonError("nested too deeply") from None
    except NotJsonError:
        raise
    except ValueError:
        found = CONSTANT.search(text)
        raise NotJsonError("a number is not finite", found.start() if found else 0) from None
    return value


def parse_record(content: str | bytes, schema: str = "", *, finite: bool = True) -> dict[str, Any]:
    """Object (dictionary) that a JSON text contains.

    Args:
        schema: required value of the key ``schema``; any if empty.
        finite: reject ``NaN`` and ``Infinity``, as in ``parse_json``.

    Raises:
        NotJsonError: as in ``parse_json``, or the value is no object, or it has another ``schema``.
    """
    value = parse_json(content, finite=finite)
    if not isinstance(value, dict):
        raise NotJsonError("not a JSON object")
    if schema and value.get("schema") != schema:
        raise NotJsonError("not written by this version of the compiler")
    return value


def is_finite_number(value: object) -> TypeGuard[int | float]:
    """Return true if a value is a finite number; Booleans are not numbers."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf


def _integer(digits: str) -> int:
    if len(digits.lstrip("-")) > LONGEST_INTEGER:
        raise NotJsonError(f"a whole number has {len(digits)} digits")
    return int(digits)


def _record(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    record = dict(pairs)
    if len(record) < len(pairs):
        twice = next(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        raise NotJsonError(f"the key {ascii(twice)[:40]} is duplicated")
    return record
