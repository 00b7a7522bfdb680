"""Atomic writing of the output folder: all of it or nothing.

The new folder is assembled next to its target and then renamed. An existing folder is replaced only with force, or if
it contains a closest infeasible candidate, and only if all of its contents are the compiler's; on failure it is
restored. It is checked again after it is moved aside, and files added by then are preserved.

    says MC701 MC702
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path

from missionc.base.diagnostics.code import OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.file_names import MANIFEST, NEAR_MISS
from missionc.output.folder.ownership import Foreign, Ours, cannot_write, exists, ownership, reason, remove, shown
from missionc.output.folder.staging import LONGEST_NAME, Staging, alone, staging, sweep
from missionc.output.folder.write_file import create, keep_rights, standing

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
