"""Traversal of a folder, and reading of its files without following a symbolic link.

    in   a folder's path, a name in it
    out  the status of all contents by relative name; the bytes of one file
    says MC002 MC004 MC708

The folder itself may be reached through a link, but its contents must not be links.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from itertools import islice
from pathlib import Path, PurePosixPath

from missionc.base.diagnostics.code import FOLDER_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.frontend.syntax.read_file import bytes_of, cannot_read

MOST_ENTRIES = 100_000
"""Maximum number of files and folders that are checked; the compiler never writes more."""


def contents(folder: Path) -> dict[str, os.stat_result]:
    """Status of the files, links and empty directories in a folder and its subfolders, by relative POSIX name.

    Symbolic links are not followed. Names that are not UTF-8 are decoded with ``os.fsdecode``. The traversal stops
    after ``MOST_ENTRIES`` + 1 entries.

    Raises:
        OSError: the folder or a subfolder cannot be read.
    """
    return dict(sorted(islice(entries(folder), MOST_ENTRIES + 1)))


def entries(folder: Path) -> Iterator[tuple[str, os.stat_result]]:
    """Yield the entries of ``contents`` in the order in which they are found.

    Raises:
        OSError: the folder or a subfolder cannot be read.
    """
    root = os.path.join(folder, "")
    unread = [("", os.lstat(folder))]
    while unread:
        within, own = unread.pop()
        with os.scandir(root + within) as listing:
            inside = [(within + entry.name, entry.stat(follow_symlinks=False)) for entry in listing]
        if not inside and within:
            yield within.removesuffix("/"), own
        for name, status in inside:
            if stat.S_ISDIR(status.st_mode):
                unread.append((f"{name}/", status))
            else:
                yield name, status


def kind(status: os.stat_result) -> str:
    """Kind of an item with its article, such as ``a symbolic link``; empty for a regular file or a folder."""
    mode = status.st_mode
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
        return ""
    return "a symbolic link" if stat.S_ISLNK(mode) else "not a regular file"


def printable(name: str) -> str:
    """Name of a file as printable text, with bytes that are not UTF-8 escaped."""
    return name.encode("utf-8", "backslashreplace").decode("utf-8")


def is_normal(name: str) -> bool:
    """Return whether a name is in normal form: relative, with ``/``, without ``.``, ``..`` and empty parts."""
    parts = name.split("/")
    return "\0" not in name and "\\" not in name and not any(part in ("", ".", "..") for part in parts)


def read_inside(folder: Path, name: str, limit: int) -> bytes | Diagnostic:
    """Contents of a regular file in a folder, at most ``limit`` bytes, or an error; no part of its name may be a link.

    Args:
        name: name in normal form.
    """
    shown = printable(str(folder / name))
    *between, last = PurePosixPath(name).parts
    handles: list[int] = []
    try:
        handles.append(os.open(folder, os.O_RDONLY | os.O_CLOEXEC | os.O_DIRECTORY))
        for part in between:
            handles.append(
                os.open(part, os.O_RDONLY | os.O_CLOEXEC | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=handles[-1])
            )
        handles.append(os.open(last, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOFOLLOW, dir_fd=handles[-1]))
        return bytes_of(handles[-1], shown, limit, None, FOLDER_UNREADABLE)
    except OSError as error:
        return cannot_read(FOLDER_UNREADABLE, shown, error)
    finally:
        for handle in handles:
            os.close(handle)
