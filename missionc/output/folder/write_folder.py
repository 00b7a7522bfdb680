"""Atomic writing of the output folder: all of it or nothing.

The new folder is assembled next to its target and then renamed. An existing folder is replaced only with force, or if
it contains a closest infeasible candidate, and only if all of its contents are the compiler's; on failure it is
restored. It is checked again after it is moved aside, and files added by then are preserved.

    says MC701 MC702

Atomic replacement of one file, with its mode and owner, through the link that names it.

    says MC702

A file that exists keeps its mode, its owner and its attributes. A file with several names (hard links), or with an
owner that cannot be given to another file, is written in place, with a temporary copy of its old contents.
"""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from missionc.base.diagnostics.code import OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.file_names import MANIFEST, NEAR_MISS
from missionc.output.folder.ownership import (
    ANOTHER_FILE,
    Foreign,
    Ours,
    cannot_write,
    exists,
    ownership,
    reason,
    remove,
    shown,
)
from missionc.output.folder.staging import LONGEST_NAME, Staging, alone, numbered, staging, sweep

NOT_REGULAR = "it is not a regular file"


def refuse_file(target: Path) -> Diagnostic | None:
    """Diagnostic if a file cannot be written, before any work is done; None if it can."""
    try:
        real = Path(os.path.realpath(target))
        parent = real.parent
        # A name that is too long is distinguished from one that is free.
        status = standing(real)
        if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
            return cannot_write(target, f"the folder `{parent}` is not writable", ANOTHER_FILE)
        sweep(parent)
        if status and not stat.S_ISREG(status.st_mode):
            return cannot_write(target, NOT_REGULAR, ANOTHER_FILE)
        if status and not os.access(real, os.W_OK):
            return cannot_write(target, "it is not writable", ANOTHER_FILE)
    except (OSError, ValueError) as error:
        return cannot_write(target, reason(error), ANOTHER_FILE)
    return None


def write_file(target: Path, content: bytes) -> Diagnostic | None:
    """Replace one file atomically, and create its parent folders; return a diagnostic if that fails."""
    try:
        _replace(Path(os.path.realpath(target)), content)
    except (OSError, ValueError) as error:
        return cannot_write(target, reason(error), ANOTHER_FILE)
    return None


def write_inside(folder: Path, name: str, content: bytes) -> Diagnostic | None:
    """Write one file in a folder like ``write_file``, unless a symbolic link in the folder leads elsewhere."""
    return linked(folder, name) or write_file(folder / name, content)


def linked(folder: Path, name: str) -> Diagnostic | None:
    """Diagnostic if a path in a folder is a symbolic link or behind one; None if it is not.

    The folder itself may be a link.
    """
    target = folder / name
    if os.path.realpath(target) == os.path.join(os.path.realpath(folder), name):
        return None
    return cannot_write(target, "a symbolic link leads out of the folder")


def beside(folder: Path, ending: str) -> Path:
    """Path next to a folder whose name is the folder's name and an ending."""
    whole = os.path.abspath(folder)
    return Path(os.path.dirname(whole)) / f"{os.path.basename(whole)}{ending}"


def standing(path: Path) -> os.stat_result | None:
    """Status of the item at a path, without following links; None if the path does not exist.

    Raises:
        OSError: no item can exist there.
    """
    try:
        return os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return None


def create(path: Path, content: bytes, mode: int = 0o666) -> None:
    """Create a new file, flushed to the disk on return; ``mode`` is subject to the umask.

    Raises:
        OSError: the file exists, or the disk is full.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
    with open(handle, "wb") as file:
        file.write(content)
        file.flush()
        # A full disk may only be noticed here.
        os.fsync(handle)


def keep_rights(new: Path, old: Path) -> bool:
    """Copy mode, owner and attributes of an old file or folder to a new one; return True if the owner matches."""
    status = os.lstat(old)
    owned = True
    if (status.st_uid, status.st_gid) != (os.lstat(new).st_uid, os.lstat(new).st_gid):
        try:
            os.chown(new, status.st_uid, status.st_gid)
        except OSError:
            owned = False
    shutil.copystat(old, new)
    os.utime(new)
    return owned


def _replace(real: Path, content: bytes) -> None:
    before = standing(real)
    if before and not stat.S_ISREG(before.st_mode):
        raise OSError(errno.EINVAL, NOT_REGULAR)
    if before and not os.access(real, os.W_OK):
        raise OSError(errno.EACCES, "it is not writable")
    real.parent.mkdir(parents=True, exist_ok=True)
    with staging(real) as staged:
        create(staged.new, content, 0o600 if before else 0o666)
        if before is None or (before.st_nlink == 1 and keep_rights(staged.new, real)):
            staged.new.replace(real)
            return
    _overwrite(real, content)


def _overwrite(real: Path, content: bytes) -> None:
    """Overwrite a file in place; a copy of the old contents exists until all is written, and is restored on failure."""
    old = real.read_bytes()
    copy = numbered(real, "before")
    create(copy, old, 0o600)
    try:
        _fill(real, content)
    except BaseException:
        try:
            _fill(real, old)
        except OSError as error:
            raise OSError(error.errno, f"{reason(error)}; its previous content is in `{copy}`") from None
        copy.unlink()
        raise
    copy.unlink()


def _fill(real: Path, content: bytes) -> None:
    handle = os.open(real, os.O_WRONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    with open(handle, "wb") as file:
        # All space is reserved before anything is overwritten.
        if content:
            with suppress(AttributeError):
                os.posix_fallocate(handle, 0, len(content))
        file.write(content)
        file.flush()
        os.ftruncate(handle, len(content))
        os.fsync(handle)


FORCE_IS_NOT_ENOUGH = "`--force` replaces only unchanged output of the compiler"


def refuse(target: Path, force: bool) -> Diagnostic | None:
    """Diagnostic if the folder cannot be written, before any work is done; None if it can.

    The function also cleans up after processes that died while they wrote there.
    """
    try:
        place = _place_of(target)
        parent = _nearest_parent(place)
        if parent == place.parent and parent.is_dir():
            sweep(parent)
        with alone(parent):
            owner = _replaceable(target, place, force) if standing(place) is not None else None
        if isinstance(owner, Diagnostic):
            return owner
        if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
            return cannot_write(target, f"the folder `{shown(parent)}` is not writable")
        if any(len(os.fsencode(name)) > LONGEST_NAME for name in place.relative_to(parent).parts):
            return cannot_write(target, f"a name is longer than {LONGEST_NAME} bytes")
    except (OSError, ValueError) as error:
        return cannot_write(target, reason(error))
    return None


def write_folder(
    target: Path, files: Mapping[str, bytes] | Iterable[tuple[str, bytes]], force: bool
) -> Diagnostic | None:
    """Write files (by relative path, with a manifest) as a folder; return a diagnostic if that fails.

    A failure or an interruption leaves nothing behind; the next process cleans up after a killed one.
    """
    refused = refuse(target, force)
    if refused is not None:
        return refused
    try:
        # The manifest comes first: it identifies the contents of an unfinished folder.
        ordered = sorted(dict(files).items(), key=lambda each: each[0] != MANIFEST)
        place = _place_of(target)
        place.parent.mkdir(parents=True, exist_ok=True)
        with staging(place, [name for name, _ in ordered]) as staged:
            staged.new.mkdir()
            for name, content in ordered:
                (staged.new / name).parent.mkdir(parents=True, exist_ok=True)
                create(staged.new / name, content)
            with alone(place.parent):
                return _put(staged, target, force)
    except (OSError, ValueError) as error:
        return cannot_write(target, reason(error))


def _put(staged: Staging, target: Path, force: bool) -> Diagnostic | None:
    """Move the old folder away and rename the new folder to its target.

    Return a diagnostic if the target is not replaceable.
    """
    place = staged.target
    if standing(place) is None:
        staged.new.rename(place)
        return None
    owner = _replaceable(target, place, force)
    if isinstance(owner, Diagnostic):
        return owner
    keep_rights(staged.new, place)
    mode = staged.new.stat().st_mode
    # An owner without write permission cannot move a folder.
    staged.new.chmod(mode | stat.S_IRWXU)
    now: Ours | Foreign | None = None
    try:
        place.rename(staged.old)
        # Files added since the check are not ours to remove.
        now = ownership(staged.old)
        if isinstance(now, Foreign):
            return _exists(target, now)
        staged.new.rename(place)
        place.chmod(mode)
        removed = remove(staged.old, now)
    except BaseException:
        if isinstance(now, Ours) and not os.path.lexists(staged.new):
            # The error came when the new folder was in place: nothing of the old one remains.
            remove(staged.old, now)
        raise
    finally:
        if os.path.lexists(staged.new) and os.path.lexists(staged.old):
            staged.put_back()
    return None if removed else _kept(target, staged.put_back())


def _replaceable(target: Path, place: Path, force: bool) -> Ours | Diagnostic:
    """Contents of the existing folder if it may be replaced, or a diagnostic with the reason why it may not."""
    owner = ownership(place)
    if isinstance(owner, Foreign):
        return _exists(target, owner)
    if force or owner.holds == NEAR_MISS:
        return owner
    help_ = "replace it with `--force`"
    return Diagnostic(OUTPUT_EXISTS, f"`{shown(target)}` exists", None, help=help_)


def _place_of(target: Path) -> Path:
    """Absolute path of the folder: links above it are resolved, its own name is not."""
    if target.name in ("", ".."):
        return Path(os.path.realpath(target))
    return Path(os.path.realpath(target.parent)) / target.name


def _nearest_parent(place: Path) -> Path:
    parent = place.parent
    while standing(parent) is None:
        parent = parent.parent
    return parent


def _exists(target: Path, foreign: Foreign) -> Diagnostic:
    return exists(target, foreign.why, foreign.strange, (FORCE_IS_NOT_ENOUGH,))


def _kept(target: Path, where: Path) -> Diagnostic:
    return exists(
        target,
        " and was replaced; other files of the old folder were kept",
        (f"they are in `{shown(where)}`: new or not removable",),
    )
