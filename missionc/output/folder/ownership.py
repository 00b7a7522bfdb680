"""Ownership of a folder by the compiler, and diagnostics of paths that must not be replaced or written.

    in   a folder's path
    out  Ours: its content and files; or Foreign: text on the contents that are not the compiler's
    says MC701 MC702

A folder is the compiler's if its manifest declares it and lists every file in it by its SHA-256. A file that is not
listed, one whose content is not the listed one, a link, a special file, and an empty folder that no listed file lies in
are not the compiler's. A folder that contains one of them is not either. A listed file may be missing. The manifest is
the one file that it cannot list.

Traversal of a folder, and reading of its files without following a symbolic link.

    in   a folder's path, a name in it
    out  the status of all contents by relative name; the bytes of one file
    says MC002 MC004 MC708

The folder itself may be reached through a link, but its contents must not be links.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path, PurePosixPath

from missionc.base.diagnostics.code import CANNOT_WRITE, FOLDER_UNREADABLE, OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.strict_json import NotJsonError, parse_record
from missionc.frontend.syntax.read_file import bytes_of, cannot_read, nowhere, read_bytes
from missionc.output.folder.file_names import MANIFEST, MANIFEST_SCHEMA, PLAN

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


MOST_NAMED = 5
"""Maximum number of foreign items in a folder that a message lists."""
LONGEST = 160
"""Maximum number of characters of a path in a message."""
ANOTHER_FOLDER, ANOTHER_FILE = "another folder with `-o`", "another file"


def exists(
    target: Path, what: str, strange: Sequence[str] = (), notes: Sequence[str] = (), instead: str = ANOTHER_FOLDER
) -> Diagnostic:
    """Diagnostic of a path that exists and must not be replaced.

    Args:
        what: rest of the sentence after "exists".
        strange: foreign contents in words; the message lists the first ones.
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
    """Text for a system error, or for a name that the operating system cannot represent."""
    if isinstance(error, FileNotFoundError) and nowhere():
        return "the working directory no longer exists"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return "its name has a character that is not allowed in file names"


def shown(name: str | os.PathLike[str]) -> str:
    """Text of a path for messages, shortened in the middle if it is long."""
    text = printable(os.fspath(name))
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}…{text[-LONGEST // 2 :]}"


MOST_LOOKED_AT = 1_000_000
"""Maximum number of items in a folder that are checked; folders of the compiler have fewer."""


class Ours(Record):
    """Folder whose contents are all the compiler's, with the files that its manifest lists.

    Args:
        files: SHA-256 of each listed file, by its name relative to the folder.
        holds: kind of the contents: plan, closest infeasible candidate, proof or export; empty for an empty folder.
        manifest: the manifest's bytes.
    """

    files: Mapping[str, str]
    holds: str
    manifest: bytes


class Foreign(Record):
    """Folder with contents that are not the compiler's: ``why`` ends a sentence, ``strange`` lists the contents."""

    why: str
    strange: tuple[str, ...] = ()


def ownership(folder: Path) -> Ours | Foreign:
    """Ownership of a folder by the compiler, from its current contents; a symbolic link to a folder is foreign."""
    try:
        return _judged(folder)
    except OSError as error:
        return Foreign(f" and cannot be listed: {reason(error)}")


def remove(folder: Path, ours: Ours) -> bool:
    """Remove the files of a folder that still match ``ours``; return True if there was nothing else.

    Files added in the meantime stay, with their folders.
    """
    try:
        for name, status in list(entries(folder)):
            if name != MANIFEST and not _strange(folder, name, status, ours):
                with suppress(IsADirectoryError):
                    os.unlink(folder / name)
        remove_folders(folder, ours.files)
        if os.listdir(folder) == [MANIFEST] and (folder / MANIFEST).read_bytes() == ours.manifest:
            os.unlink(folder / MANIFEST)
        folder.rmdir()
    except OSError:
        return False
    return True


def remove_folders(folder: Path, files: Iterable[str]) -> None:
    """Remove the subfolders that contained these files, if they are empty."""
    for name in sorted(_parents(files), key=lambda name: -name.count("/")):
        with suppress(OSError):
            (folder / name).rmdir()


def listed_files(manifest: bytes) -> Ours | None:
    """Contents of a folder as its manifest lists them; None if it is not a manifest of the compiler."""
    try:
        says = parse_record(manifest, MANIFEST_SCHEMA)
    except NotJsonError:
        return None
    files = says.get("files")
    return Ours(files, str(says.get("holds", PLAN)), manifest) if isinstance(files, dict) else None


def _judged(folder: Path) -> Ours | Foreign:
    status = os.lstat(folder)
    if not stat.S_ISDIR(status.st_mode):
        return Foreign(f" and is {_kind(status)}")
    names = sorted(os.listdir(folder))
    if not names:
        return Ours({}, "", b"")
    if MANIFEST not in names:
        return Foreign(f" and is not an output folder: it has no `{MANIFEST}`", tuple(map(_quoted, names)))
    content = read_bytes(folder / MANIFEST, MANIFEST, Limits().trace_bytes, FOLDER_UNREADABLE)
    ours = None if isinstance(content, Diagnostic) else listed_files(content)
    if ours is None:
        return Foreign(f" and is not an output folder: its `{MANIFEST}` is invalid", tuple(map(_quoted, names)))
    listing = islice(entries(folder), MOST_LOOKED_AT)
    strange = [
        f"{_quoted(name)}, {why}" for name, status in sorted(listing) if (why := _strange(folder, name, status, ours))
    ]
    if strange:
        return Foreign(" and has files that the compiler did not write", tuple(strange))
    return ours


def _strange(folder: Path, name: str, status: os.stat_result, ours: Ours) -> str:
    """Reason why an item in a folder is not the compiler's; empty if it belongs to the compiler."""
    if stat.S_ISDIR(status.st_mode):
        return "" if any(file.startswith(f"{name}/") for file in ours.files) else "an empty folder"
    if not stat.S_ISREG(status.st_mode):
        return _kind(status)
    if name == MANIFEST:
        return ""
    if name not in ours.files:
        return f"not listed in its `{MANIFEST}`"
    return "" if sha256_of(folder / name) == ours.files[name] else "changed after it was written"


def _kind(status: os.stat_result) -> str:
    return (
        "a symbolic link"
        if stat.S_ISLNK(status.st_mode)
        else "a file"
        if stat.S_ISREG(status.st_mode)
        else "not a regular file"
    )


def sha256_of(path: Path) -> str:
    """SHA-256 of a regular file; empty if the path is no longer a regular file."""
    handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    with open(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            return ""
        return hashlib.file_digest(file, "sha256").hexdigest()


def _parents(files: Iterable[str]) -> set[str]:
    """Relative paths of the subfolders that contain the files."""
    return {str(parent) for name in files if is_normal(name) for parent in PurePosixPath(name).parents} - {"."}


def _quoted(name: str) -> str:
    return f"`{shown(name)}`"
