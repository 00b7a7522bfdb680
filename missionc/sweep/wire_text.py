"""Texts that go over the wire between who asks and who works: one line of JSON, of numbers, words and files.

in   a document, the contents of files
out  one line of ASCII, and back
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from typing import Any


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
