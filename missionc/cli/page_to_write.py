"""Check of a page that a command would write next to a folder, over something else.

in   the path, whether the user named it, the inputs of the command
says MC701 MC702
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.overlap import WrittenPath, overlapping
from missionc.output.folder.ownership import exists
from missionc.output.folder.write_file import refuse_file

TITLE = "· missionc report</title>".encode()
HEAD = 4096
"""Bytes of a page that contain its title."""


def refuse_page(
    target: Path, named: bool, inputs: Iterable[Path], others: Iterable[WrittenPath] = ()
) -> Diagnostic | None:
    """Finding if a page cannot be written, before any work; a default file must already be a page.

    Args:
        others: other outputs of the command.
    """
    wrong = overlapping([WrittenPath("-o", target), *others], inputs)
    return wrong or refuse_file(target) or (None if named else _not_ours(target))


def _not_ours(target: Path) -> Diagnostic | None:
    """Finding if a default file is not a page of the compiler and must not be replaced."""
    try:
        with target.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return None
    return (
        None
        if TITLE in head
        else exists(target, " and is not a page of the compiler", instead="another file with `-o`")
    )
