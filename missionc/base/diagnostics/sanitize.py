"""Sanitizing of untrusted text from a mission, a file name or a flag: harmless for a terminal and its reader.

A terminal acts on some characters instead of showing them: it moves its cursor, changes its title, or turns the order
of a line around. They are written as Python writes them, ``\\x1b``. A document for programs has them as JSON does.
"""

from __future__ import annotations

import json
import re
import unicodedata

UNUSUAL = re.compile(r"[^\t\n\x20-\x7e]")

ACTED_ON = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Categories of Unicode: controls, formats (the overrides of direction among them), surrogates, other line ends."""


def plain(text: str) -> str:
    """The text with every character that a terminal acts on, line ends and tabs aside, written out."""
    return UNUSUAL.sub(lambda match: _written(match[0]), text)


def plain_line(text: str) -> str:
    """The same for what has to stay one line, such as the name of a file."""
    return plain(text).replace("\n", "\\n")


def as_json(document: object) -> str:
    """A document as indented JSON: every text exact, what a terminal acts on escaped.

    Raises:
        ValueError: a number is not finite.
    """
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return UNUSUAL.sub(lambda match: json.dumps(match[0])[1:-1] if _acted_on(match[0]) else match[0], text)


def _written(letter: str) -> str:
    if not _acted_on(letter):
        return letter
    return letter.encode("unicode_escape").decode("ascii")


def _acted_on(letter: str) -> bool:
    return unicodedata.category(letter) in ACTED_ON
