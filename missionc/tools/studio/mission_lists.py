"""Lists of missions to open: those in the folder, in the gallery, and the templates, each by name."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from missionc import Diagnostic, Limits
from missionc.base.diagnostics.code import UNREADABLE
from missionc.base.resources import folder
from missionc.frontend.templates import templates
from missionc.tools.studio.text_file import TextFile, fresh, opened_text

SUFFIX = ".mission"
MOST = 500
"""Maximum number of missions listed from one folder."""

Shelf = Literal["folder", "gallery", "template"]
SHELVES: tuple[Shelf, ...] = ("folder", "gallery", "template")


def listed(shelf: Shelf, home: Path) -> list[dict[str, str]]:
    """Missions on a shelf as ``name`` and ``about``, the description from the first comment.

    Args:
        shelf: ``folder``, ``gallery`` or another list of missions.
        home: folder of the user's missions.
    """
    match shelf:
        case "folder":
            return [{"name": path.name, "about": ""} for path in _missions(home)]
        case "gallery":
            return [{"name": path.stem, "about": _about(path)} for path in _missions(folder("missions") / "gallery")]
        case "template":
            return [{"name": each.name, "about": each.about} for each in templates().values()]


def taken(shelf: Shelf, name: str, home: Path, limits: Limits) -> TextFile | Diagnostic:
    """Read a mission from a shelf, or return the error; one that is not from the folder has no file yet.

    A text from the gallery has its path there, so that the files that it includes are found.

    Args:
        shelf: list of missions.
        name: name on the shelf.
        home: folder of the user's missions.
        limits: maximum sizes of a mission.
    """
    if name not in [entry["name"] for entry in listed(shelf, home)]:
        return Diagnostic(UNREADABLE, f"there is no `{name}` to open", None, help="choose a listed mission")
    match shelf:
        case "folder":
            return opened_text(home / name, limits)
        case "gallery":
            copied = opened_text(folder("missions") / "gallery" / f"{name}{SUFFIX}", limits)
            return copied if isinstance(copied, Diagnostic) else TextFile(copied.path, copied.text)
        case "template":
            template = templates()[name]
            return TextFile(fresh(home, template.mission), template.text)


def _missions(place: Path) -> Iterator[Path]:
    """Yield the missions in a folder, without links that lead out of it."""
    root = place.resolve()
    found = (path for path in sorted(place.glob(f"*{SUFFIX}")) if path.is_file() and path.resolve().parent == root)
    yield from (path for path, _ in zip(found, range(MOST), strict=False))


def _about(path: Path) -> str:
    """First sentence of the comment at the start of a mission file."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    words = " ".join(lines)
    return words.partition(". ")[0].rstrip(".") + "." if words else ""
