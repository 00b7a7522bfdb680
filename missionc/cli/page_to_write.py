"""Check before a page is written next to a folder, so that it replaces no file of another kind.

in   the path, whether the user named it, the inputs of the command
says MC701 MC702
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.overlap import WrittenPath, overlapping
from missionc.output.folder.ownership import exists
from missionc.output.folder.write_folder import refuse_file

TITLE = "· missionc report</title>".encode()
HEAD = 4096
"""Number of bytes at the start of a page that contain its title."""


def refuse_page(
    target: Path, named: bool, inputs: Iterable[Path], others: Iterable[WrittenPath] = ()
) -> Diagnostic | None:
    """Finding that a page cannot be written, before any work; None if it can.

    Args:
        target: path of the page.
        named: whether the user named it; an existing file at a default path must be a page.
        inputs: input paths of the command.
        others: its other outputs.
    """
    wrong = overlapping([WrittenPath("-o", target), *others], inputs)
    return wrong or refuse_file(target) or (None if named else _not_ours(target))


def _not_ours(target: Path) -> Diagnostic | None:
    """Finding that a file is not a page of the compiler, so that it must not be replaced; None otherwise."""
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
