"""Folders in the compiler's format, and their contents."""

from __future__ import annotations

from pathlib import Path

from missionc.output.folder.file_names import MANIFEST, PLAN
from missionc.output.folder.manifest import without_plan
from missionc.output.folder.write_folder import write_folder


def with_manifest(files: dict[str, bytes], holds: str = PLAN) -> tuple[tuple[str, bytes], ...]:
    """Files with a manifest that lists them."""
    return (*files.items(), (MANIFEST, without_plan("small", holds, files).encode()))


def written(target: Path, files: dict[str, bytes], holds: str = PLAN) -> Path:
    """Write a new folder with these files."""
    assert write_folder(target, with_manifest(files, holds), force=False) is None
    return target


def content(folder: Path) -> dict[str, bytes]:
    """All files in a folder, by relative name."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def unlisted(folder: Path) -> dict[str, bytes]:
    """Files as in ``content``, without the manifest."""
    return {name: held for name, held in content(folder).items() if name != MANIFEST}
