"""Sanitizing of untrusted text (a mission, a file name, an option) before it is printed on a terminal.

A terminal interprets control characters: they move its cursor, change its title, or reverse the text direction. These
characters are escaped as in Python, ``\\x1b``; in JSON output they have JSON escapes.
"""

from __future__ import annotations

import json
import re
import unicodedata

UNUSUAL = re.compile(r"[^\t\n\x20-\x7e]")

ACTED_ON = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Escaped Unicode categories: control and format characters, surrogates, line and paragraph separators."""


def plain(text: str) -> str:
    """Text with all control characters except line ends and tabs escaped."""
    return UNUSUAL.sub(lambda match: _written(match[0]), text)


def plain_line(text: str) -> str:
    """Text with all control characters, line ends included, escaped; for single lines such as a file name."""
    return plain(text).replace("\n", "\\n")


def as_json(document: object) -> str:
    """Document as indented JSON, with control characters in strings escaped.

    Raises:
        ValueError: the document contains an infinite number or NaN.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return UNUSUAL.sub(lambda match: json.dumps(match[0])[1:-1] if _acted_on(match[0]) else match[0], text)


def _written(letter: str) -> str:
    if not _acted_on(letter):
        return letter
    return letter.encode("unicode_escape").decode("ascii")


def _acted_on(letter: str) -> bool:
    return unicodedata.category(letter) in ACTED_ON
