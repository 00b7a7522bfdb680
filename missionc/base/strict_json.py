"""Strict JSON reader: rejects everything that two readers could interpret differently.

No key is duplicated, every number is finite (unless the caller
takes others) and no longer than a double or a 64-bit integer needs, no half of
a surrogate pair stands alone, and nothing is nested deeper than a reader goes.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from typing import Any, TypeGuard

from missionc.base.limits import Limits

LONGEST_INTEGER = 19
"""Maximum number of digits of an integer: more do not fit into 64 bits."""
CONSTANT = re.compile(r"-?(?:NaN|Infinity)")
"""Numbers that JSON does not allow, as some writers have them."""

VALUES = Limits().json_values
"""Default maximum number of values in a text."""


class NotJsonError(ValueError):
    """Error for text that is not valid JSON: the reason as a phrase, and its place in the text."""

    def __init__(self, reason: str, place: int = 0) -> None:
        super().__init__(reason)
        self.reason, self.place = reason, place


def parse_json(content: str | bytes, most: int = VALUES, *, finite: bool = True) -> Any:
    """Parse the value in a text or in UTF-8 bytes.

    Args:
        most: maximum number of values in it, including nested ones.
        finite: reject ``NaN`` and ``Infinity``; otherwise they are kept.

    Raises:
        NotJsonError: the text contains no value, an ambiguous one, or too many.
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
    """Parse the record in a text.

    Args:
        schema: required value of ``schema``; any if empty.
        finite: as in ``parse_json``.

    Raises:
        NotJsonError: as in ``parse_json``, or the value is not such a record.
    """
    value = parse_json(content, finite=finite)
    if not isinstance(value, dict):
        raise NotJsonError("not a JSON object")
    if schema and value.get("schema") != schema:
        raise NotJsonError("not written by this version of the compiler")
    return value


def is_finite_number(value: object) -> TypeGuard[int | float]:
    """Return whether a value is a finite number, and not a Boolean."""
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
