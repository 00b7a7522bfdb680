"""Sanitizing of untrusted text from a mission, a file name or a flag for terminals.

A terminal interprets some characters instead of showing them: they move its cursor, change its title, or reverse the
order of a line. They are escaped as in Python, ``\\x1b``. A document for programs has them as in JSON.
"""

from __future__ import annotations

import json
import re
import unicodedata

UNUSUAL = re.compile(r"[^\t\n\x20-\x7e]")

ACTED_ON = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Unicode categories of control characters, formats (with direction overrides), surrogates and other line ends."""


def plain(text: str) -> str:
    """Text with all control characters escaped, except line ends and tabs."""
    return UNUSUAL.sub(lambda match: _written(match[0]), text)


def plain_line(text: str) -> str:
    """Text with all control characters escaped, for single lines such as the name of a file."""
    return plain(text).replace("\n", "\\n")


def as_json(document: object) -> str:
    """Document as indented JSON: texts are exact, with control characters escaped.

    Raises:
        ValueError: the document contains a number that is not finite.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return UNUSUAL.sub(lambda match: json.dumps(match[0])[1:-1] if _acted_on(match[0]) else match[0], text)


def _written(letter: str) -> str:
    if not _acted_on(letter):
        return letter
    return letter.encode("unicode_escape").decode("ascii")


def _acted_on(letter: str) -> bool:
    return unicodedata.category(letter) in ACTED_ON
