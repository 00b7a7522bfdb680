"""Refusals to write: a place that exists and is not to be replaced, and one that cannot be written to.

says MC701 MC702
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from missionc.diagnostics.code import CANNOT_WRITE, OUTPUT_EXISTS
from missionc.diagnostics.model import Diagnostic
from missionc.output.folder.walk_folder import printable
from missionc.syntax.read_file import nowhere

MOST_NAMED = 5
"""Things in a folder that a message names."""
LONGEST = 160
"""Characters of a path that a message shows."""
ANOTHER_FOLDER, ANOTHER_FILE = "another folder with `-o`", "another file"


def exists(
    target: Path, what: str, strange: Sequence[str] = (), notes: Sequence[str] = (), instead: str = ANOTHER_FOLDER
) -> Diagnostic:
    """A place that is not replaced, whatever is asked for.

    Args:
        what: the rest of the sentence, after "exists".
        strange: what in it the compiler did not write, in words, the first of them to be named.
    """
    more = len(strange) - MOST_NAMED
    named = [*strange[:MOST_NAMED], *([f"and {more} more"] if more > 0 else [])]
    return Diagnostic(
        OUTPUT_EXISTS,
        f"`{shown(target)}` exists{what}",
        None,
        notes=(*named, *notes),
        help=f"name {instead}",
    )


def cannot_write(target: Path, why: str, instead: str = ANOTHER_FOLDER) -> Diagnostic:
    return Diagnostic(CANNOT_WRITE, f"`{shown(target)}` cannot be written", None, notes=(why,), help=f"name {instead}")


def reason(error: OSError | ValueError) -> str:
    """The words for what the system says, or for a name that it cannot hold at all."""
    if isinstance(error, FileNotFoundError) and nowhere():
        return "the folder that this runs in is gone"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return "its name holds a character that no file name may hold"


def shown(name: str | os.PathLike[str]) -> str:
    """A path as messages show it: as text, and cut in the middle where it is long."""
    text = printable(os.fspath(name))
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}…{text[-LONGEST // 2 :]}"
