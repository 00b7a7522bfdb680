"""The contents of a folder, down to its last file, with nothing followed.

in   a folder's path
out  the status of everything in it by its relative name
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path


def contents(folder: Path) -> dict[str, os.stat_result]:
    """Everything in a folder that is no plain directory, and directories that hold nothing, by relative POSIX names.

    A symbolic link is there as itself, wherever it leads. Names that are not
    UTF-8 are as ``os.fsdecode`` gives them.

    Raises:
        OSError: the folder, or one in it, cannot be read.
    """
    return dict(sorted(entries(folder)))


def entries(folder: Path) -> Iterator[tuple[str, os.stat_result]]:
    """``contents``, one after the other as they are found.

    Raises:
        OSError: as of ``contents``.
    """
    root = os.path.join(folder, "")
    unread = [("", os.lstat(folder))]
    while unread:
        within, own = unread.pop()
        with os.scandir(root + within) as found:
            inside = [(within + entry.name, entry.stat(follow_symlinks=False)) for entry in found]
        if not inside and within:
            yield within.removesuffix("/"), own
        for name, status in inside:
            if stat.S_ISDIR(status.st_mode):
                unread.append((f"{name}/", status))
            else:
                yield name, status
