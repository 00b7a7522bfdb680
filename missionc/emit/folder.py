"""The output folder: it appears whole or not at all.

Everything is written into a sibling folder first and renamed into place. An
existing folder is replaced only by force, or where it holds no more than a
nearest miss, and comes back if that fails.

    says MC701 MC702
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from missionc.diagnostics.code import CANNOT_WRITE, OUTPUT_EXISTS
from missionc.diagnostics.model import Diagnostic
from missionc.export import FORMATS

MISS = re.compile(r"near_miss\.(json|svg|html)|\.DS_Store")
"""What lies in the folder of a mission that got no plan: nobody misses it once there is one."""

OURS = re.compile(
    r"(plan|certificate|manifest)\.json|trajectories\.csv|crazyflie|mission|report\.html|simulation\.json|.+\.(cnf|drat)"
    rf"|{MISS.pattern}|export|{'|'.join(FORMATS)}"
)
"""What may lie in an output folder; anything else was put there by somebody."""

STAGED = re.compile(r"\.(?P<name>.+)\.missionc-(?P<process>\d+)-[0-9a-f]{8}(?P<old>\.old)?")


def refuse(target: Path, force: bool) -> Diagnostic | None:
    """What forbids writing to the folder, to be said before any work is done; absent where nothing does.

    Tidies up after processes that died while they wrote there.
    """
    if target.absolute().parent.is_dir():
        sweep(target.absolute().parent)
    if os.path.lexists(target) and not _replaceable(target, force):
        return _exists(target, force)
    parent = _nearest_parent(target)
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        return _cannot_write(target, f"`{parent}` is not a folder one can write to")
    return None


def refuse_file(target: Path) -> Diagnostic | None:
    """What forbids writing a file, to be said before any work is done; absent where nothing does."""
    parent = target.absolute().parent
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        return _cannot_write(target, f"`{parent}` is not a folder one can write to", "another file")
    sweep(parent)
    if os.path.lexists(target) and not target.is_file():
        return _cannot_write(target, "it is no regular file", "another file")
    return None


def write_folder(target: Path, files: Iterable[tuple[str, bytes]], force: bool) -> Diagnostic | None:
    """Write the files (by relative path) as the folder ``target``; what went wrong, if anything did.

    Nothing is left behind by a failure or an interruption; what a process that
    was killed leaves, the next one sweeps.
    """
    refused = refuse(target, force)
    if refused is not None:
        return refused
    target = target.absolute()
    staged = target.parent / f".{target.name}.missionc-{os.getpid()}-{secrets.token_hex(4)}"
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staged.mkdir()
        for name, content in files:
            _write(staged / name, content)
        return _place(staged, target, force)
    except OSError as error:
        return _cannot_write(target, error.strerror or str(error))
    finally:
        shutil.rmtree(staged, ignore_errors=True)


def sweep(parent: Path) -> None:
    """Tidy up after processes that died in between; a folder they had moved aside returns to its place."""
    for path in sorted(parent.glob(".*.missionc-*")):
        match = STAGED.fullmatch(path.name)
        if match is None or path.is_symlink() or _alive(int(match["process"])):
            continue
        target = parent / match["name"]
        # What cannot be tidied up stays; it is in nobody's way.
        with suppress(OSError):
            if match["old"] and not os.path.lexists(target):
                path.rename(target)
            elif path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()


def write_file(target: Path, content: bytes) -> Diagnostic | None:
    """One file, replaced as a whole; what went wrong, if anything did."""
    staged = target.absolute().parent / f".{target.name}.missionc-{os.getpid()}-{secrets.token_hex(4)}"
    try:
        _write(staged, content)
        staged.replace(target)
    except OSError as error:
        return _cannot_write(target, error.strerror or str(error), "another file")
    finally:
        staged.unlink(missing_ok=True)
    return None


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        # A full disk may only be noticed here.
        os.fsync(file.fileno())


def _place(staged: Path, target: Path, force: bool) -> Diagnostic | None:
    if not os.path.lexists(target):
        staged.rename(target)
        return None
    if not _replaceable(target, force):
        return _exists(target, force)
    aside = staged.with_name(staged.name + ".old")
    target.rename(aside)
    try:
        staged.rename(target)
    except BaseException:
        aside.rename(target)
        raise
    shutil.rmtree(aside, ignore_errors=True)
    return None


def _replaceable(target: Path, force: bool) -> bool:
    """Force replaces what the compiler wrote, never a home directory given by mistake; a nearest miss goes without."""
    if target.is_symlink() or not target.is_dir():
        return False
    if force:
        return not _foreign(target)
    names = [path.name for path in target.iterdir()]
    return bool(names) and all(MISS.fullmatch(name) for name in names)


def _foreign(target: Path) -> list[str]:
    """What is in a folder and was not written by the compiler."""
    return sorted(path.name for path in target.iterdir() if not OURS.fullmatch(path.name))


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _nearest_parent(target: Path) -> Path:
    parent = target.absolute().parent
    while not os.path.lexists(parent):
        parent = parent.parent
    return parent


def _exists(target: Path, force: bool) -> Diagnostic:
    if force:
        foreign = _foreign(target) if target.is_dir() and not target.is_symlink() else []
        what = f"holds `{foreign[0]}`, which is no output" if foreign else "is no folder"
        note = "`--force` replaces nothing but the compiler's own output"
        help_ = "name another folder with `-o`"
        return Diagnostic(OUTPUT_EXISTS, f"`{target}` exists and {what}", None, notes=(note,), help=help_)
    return Diagnostic(
        OUTPUT_EXISTS, f"`{target}` exists", None, help="name another folder with `-o`, or replace it with `--force`"
    )


def _cannot_write(target: Path, why: str, instead: str = "another folder with `-o`") -> Diagnostic:
    return Diagnostic(CANNOT_WRITE, f"`{target}` cannot be written", None, notes=(why,), help=f"name {instead}")
