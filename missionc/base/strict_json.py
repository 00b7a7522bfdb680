"""A strict JSON reader: everything that two readers could understand differently is refused.

No key comes twice in one record, no number is longer than a double or a 64-bit
integer needs, no half of a surrogate pair stands alone, and nothing is nested
deeper than a reader goes. ``NaN`` and ``Infinity`` are left to who wants finite numbers.
"""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from missionc.base.limits import Limits

LONGEST_INTEGER = 19
"""Digits: more do not fit into 64 bits."""

VALUES = Limits().json_values
"""Values of a text, if nothing else is allowed."""


class NotJsonError(ValueError):
    """Text that is no JSON for us: a phrase that says why, and the place in the text where that is seen."""

    def __init__(self, reason: str, place: int = 0) -> None:
        super().__init__(reason)
        self.reason, self.place = reason, place


def parse_json(text: str, most: int = VALUES) -> Any:
    """The value that a text holds.

    Args:
        most: values in it, those within others counted too.

    Raises:
        NotJsonError: it holds none, one that is not the same for every reader, or too many.
    """
    count = 1 + text.count(",") + text.count("[") + text.count("{")
    if count > most:
        raise NotJsonError(
            f"it has about {count} values; the limit is {most}; `--limit json_values={count}` allows more"
        )
    try:
        value = json.loads(text, parse_int=_integer, object_pairs_hook=_record)
        # Half of a surrogate pair is no character: nothing could be written of it.
        json.dumps(value, ensure_ascii=False).encode()
    except json.JSONDecodeError as error:
        raise NotJsonError(f"this is not JSON: {error.msg}", error.pos) from None
    except UnicodeEncodeError:
        raise NotJsonError("half of a surrogate pair stands alone in a text") from None
    except RecursionError:
        raise NotJsonError("the lists are nested too deep") from None
    return value


def _integer(digits: str) -> int:
    if len(digits.lstrip("-")) > LONGEST_INTEGER:
        raise NotJsonError(f"a whole number has {len(digits)} digits")
    return int(digits)


def _record(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    record = dict(pairs)
    if len(record) < len(pairs):
        twice = next(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        raise NotJsonError(f"the key {ascii(twice)[:40]} comes twice in one record")
    return record
