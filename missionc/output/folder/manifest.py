"""The manifest: inputs, outputs and versions of a compilation, so that the same bytes can be produced again.

Every written folder has one, from which ``ownership`` detects the compiler's files.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

from missionc.base.late_dataclass import Record
from missionc.base.trace import Plan
from missionc.output.folder.file_names import MANIFEST_SCHEMA
from missionc.output.json_layout import compact, record
from missionc.version import __version__

PACKAGES = ("numpy", "scipy", "shapely", "piqp", "z3-solver", "python-sat", "torch", "jinja2", "mcap")
"""Packages whose version may change a plan or its files."""

Option = str | int | float | bool


class Provenance(Record):
    """Origin of a plan: its inputs, the options that change it, and the packages that it used.

    Args:
        inputs: the mission's files, the mission first: names relative to its folder, and contents.
        options: choices that change the plan, by their name on the command line.
        cut_short: reason why the search ended early, in two words; empty if it was completed.
        stretch: ratio of the flight's duration to the duration in the mission's text.
        data: names of the inputs that are not missions.
        past: text of the flight before the plan begins; empty if there is none.
        packages: the packages of extensions that were used, by name and version.
    """

    inputs: tuple[tuple[str, bytes], ...]
    options: tuple[tuple[str, Option], ...] = ()
    cut_short: str = ""
    stretch: float = 1.0
    data: frozenset[str] = frozenset()
    past: str = ""
    packages: tuple[tuple[str, str], ...] = ()


def manifest(plan: Plan, provenance: Provenance, files: Mapping[str, bytes]) -> str:
    """Content of ``manifest.json`` for a folder with a plan; ``files`` are all other files in the folder."""
    head = {
        "schema": MANIFEST_SCHEMA,
        "mission": plan.mission,
        "backend": plan.backend,
        "seed": plan.seed,
        "cut_short": provenance.cut_short or None,
    }
    inputs = {name: sha256(content) for name, content in provenance.inputs}
    return _text({**head, "inputs": inputs, **_blocks(files, provenance), "options": dict(provenance.options)})


def without_plan(mission: str, holds: str, files: Mapping[str, bytes], provenance: Provenance | None = None) -> str:
    """Content of ``manifest.json`` for a folder without a plan.

    Args:
        holds: contents of the folder, as named in ``file_names``.
        files: all other files of the folder.
        provenance: origin, if the contents can be verified from the folder alone.
    """
    head: dict[str, object] = {"schema": MANIFEST_SCHEMA, "mission": mission, "holds": holds}
    if provenance is None:
        return _text({**head, **_blocks(files)})
    inputs = {name: sha256(content) for name, content in provenance.inputs}
    return _text({**head, "inputs": inputs, **_blocks(files, provenance), "options": dict(provenance.options)})


def relisted(before: Mapping[str, object], files: Mapping[str, bytes]) -> bytes:
    """Content of a manifest to which files are added that were written later; all other entries stay unchanged."""
    listed = before.get("files")
    known = dict(listed) if isinstance(listed, dict) else {}
    known.update((name, sha256(content)) for name, content in files.items())
    return _text({**before, "files": {name: known[name] for name in sorted(known)}}).encode()


def _blocks(files: Mapping[str, bytes], provenance: Provenance | None = None) -> dict[str, object]:
    own = {"missionc": __version__, "python": platform.python_version(), **versions()}
    return {
        "files": {name: sha256(files[name]) for name in sorted(files)},
        "versions": {**own, **dict(provenance.packages if provenance else ())},
    }


def _text(entries: Mapping[str, object]) -> str:
    lines = [
        f"  {compact(key)}: {record(value, depth=1) if isinstance(value, dict) else compact(value)}"
        for key, value in entries.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def versions() -> dict[str, str]:
    """Versions of this package and of the installed packages that may change a plan."""
    installed = {"missionc": __version__}
    for package in PACKAGES:
        try:
            installed[package] = version(package)
        except PackageNotFoundError:
            continue
    return installed
