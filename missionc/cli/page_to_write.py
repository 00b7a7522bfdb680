"""Refusal of a page that a command would write beside a folder, where something else stands there.

in   the path, whether the user named it, what the command reads
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
"""Bytes of a page, within which its title stands."""


def refuse_page(
    target: Path, named: bool, inputs: Iterable[Path], others: Iterable[WrittenPath] = ()
) -> Diagnostic | None:
    """What forbids writing a page, to be said before any work is done; a file that nobody named has to be one already.

    Args:
        others: what else the command writes.
    """
    wrong = overlapping([WrittenPath("-o", target), *others], inputs)
    return wrong or refuse_file(target) or (None if named else _not_ours(target))


def _not_ours(target: Path) -> Diagnostic | None:
    """What forbids replacing a file that nobody named: it is no page of the compiler's."""
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
