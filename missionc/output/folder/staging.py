"""Staging folders: locked, next to the target, for new content and the content that it replaces.

in   the path of the file or folder to write
out  Staging: paths for the new and the old content

A staging folder is called ``.missionc-`` and 16 hexadecimal digits, is accessible to its owner only, and contains
``staging.json``, which identifies it with its digits and target, and is locked while its process lives. The next
process that writes in the same folder cleans up after a killed one: it touches only folders with such a file, complete
and unlocked, and folders that are empty or contain only an empty such file. The target's old folder returns to its
path, or is removed as ``ownership.remove`` removes; of the new folder, the files that its manifest lists are removed
whatever they contain, since the process may have died in the middle of one. Anything else stays. Changes to a listed
file in the ``new`` of a dead process's staging folder are lost.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from missionc.base.late_dataclass import Record
from missionc.base.strict_json import parse_record
from missionc.output.folder.file_names import MANIFEST
from missionc.output.folder.ownership import Ours, entries, listed_files, ownership, remove, remove_folders

NAME = re.compile(r"\.missionc-([0-9a-f]{16})")
MARKER, SCHEMA = "staging.json", "missionc.staging/1"
LONGEST_MARKER = 1 << 14
ATTEMPTS = 5
"""Maximum number of attempts to create a staging folder, which another process may clean up too early."""
LONGEST_NAME = 255
"""Maximum length of a name in common file systems, bytes."""


class Staging(Record):
    """Staging folder at ``path`` for the new content of ``target``."""

    path: Path
    target: Path

    @property
    def new(self) -> Path:
        """Path at which the new file or folder is assembled."""
        return self.path / "new"

    @property
    def old(self) -> Path:
        """Path of the replaced folder."""
        return self.path / "old"

    def put_back(self) -> Path:
        """Move the old folder back to the target, or next to it if the target exists, and return its path."""
        place = self.target if not os.path.lexists(self.target) else numbered(self.target, "kept")
        self.old.rename(place)
        return place

    def clear(self, names: Iterable[str]) -> None:
        """Remove the new file, or the named files of the new folder, and then the staging folder if it is empty."""
        with suppress(OSError):
            if self.new.is_dir():
                _scrap(self.new, names)
            else:
                self.new.unlink(missing_ok=True)
        if not os.path.lexists(self.new) and not os.path.lexists(self.old):
            with suppress(OSError):
                (self.path / MARKER).unlink(missing_ok=True)
                self.path.rmdir()


@contextmanager
def staging(target: Path, names: Iterable[str] = ()) -> Iterator[Staging]:
    """Context with a staging folder, from which the named files are removed afterwards.

    Args:
        target: absolute path without links above it.
        names: names of all files of the new folder, if it is one.

    Raises:
        OSError: the folder cannot be created next to the target.
    """
    token = secrets.token_hex(8)
    staged = Staging(target.parent / f".missionc-{token}", target)
    try:
        handle = _begun(staged, token)
        try:
            yield staged
        finally:
            staged.clear(names)
            os.close(handle)
    except BaseException:
        # A signal may have arrived during cleanup; none arrives twice.
        if os.path.lexists(staged.old) and not os.path.lexists(target):
            staged.put_back()
        staged.clear(names)
        with suppress(OSError):
            staged.path.rmdir()
        raise


def _begun(staged: Staging, token: str) -> int:
    """Create the staging folder with its marker file, locked and complete, and return the marker's handle.

    Another process may clean up an unfinished staging folder; then it is created again.
    """
    for attempt in range(ATTEMPTS):
        staged.path.mkdir(mode=0o700)
        try:
            handle = os.open(staged.path / MARKER, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        except FileNotFoundError:
            if attempt == ATTEMPTS - 1:
                raise
            continue
        # Without locks, nothing is cleaned up either.
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        os.write(handle, json.dumps({"schema": SCHEMA, "token": token, "target": staged.target.name}).encode())
        if os.fstat(handle).st_nlink:
            return handle
        os.close(handle)
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


@contextmanager
def alone(parent: Path) -> Iterator[None]:
    """Context that waits until no other compiler process checks or renames folders in ``parent``.

    Without file locks, it continues at once.
    """
    handle = None
    with suppress(OSError):
        handle = os.open(parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        fcntl.flock(handle, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if handle is not None:
            os.close(handle)


def sweep(parent: Path) -> None:
    """Clean up staging folders in ``parent`` whose processes died while they wrote there."""
    with suppress(OSError):
        for name in sorted(os.listdir(parent)):
            if NAME.fullmatch(name):
                with suppress(OSError):
                    _recover(parent / name)


def numbered(target: Path, what: str) -> Path:
    """Unused path next to a file or folder, with its purpose in the name; shortened if it would be too long."""
    ending = f".{what}-{secrets.token_hex(4)}"
    return target.with_name(os.fsdecode(os.fsencode(target.name)[: LONGEST_NAME - len(ending)]) + ending)


def _recover(path: Path) -> None:
    if not stat.S_ISDIR(os.lstat(path).st_mode):
        return
    with suppress(OSError):
        path.rmdir()  # its process died before the marker was in it, or after
    handle = os.open(path / MARKER, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        marker = os.read(handle, LONGEST_MARKER)
        if not marker and os.listdir(path) == [MARKER]:
            (path / MARKER).unlink()  # its process died before it wrote it
            path.rmdir()
            return
        target = _target(marker, path)
        if target is None:
            return
        left = Staging(path, target)
        if left.old.is_dir():
            owner = ownership(left.old)
            if not os.path.lexists(target) or not isinstance(owner, Ours) or not remove(left.old, owner):
                left.put_back()
        manifest = left.new / MANIFEST
        says = listed_files(manifest.read_bytes()) if manifest.is_file() else None
        left.clear(says.files if says else ())
    finally:
        os.close(handle)


def _target(marker: bytes, path: Path) -> Path | None:
    """Target of a staging folder from its marker file.

    None if the marker is incomplete or belongs to another folder.
    """
    try:
        says = parse_record(marker)
        name = str(says["target"])
        ours = says["schema"] == SCHEMA and path.name == f".missionc-{says['token']}"
    except (ValueError, TypeError, KeyError):
        return None
    return path.parent / name if ours and os.path.basename(name) == name and name not in ("", ".", "..") else None


def _scrap(folder: Path, names: Iterable[str]) -> None:
    """Remove the named files of a folder, its manifest, and the subfolders that become empty."""
    names = {*names, MANIFEST}
    for name, status in list(entries(folder)):
        if name in names and not stat.S_ISDIR(status.st_mode):
            os.unlink(folder / name)
    remove_folders(folder, names)
    folder.rmdir()
