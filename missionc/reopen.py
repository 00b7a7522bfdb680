"""A folder that ``compile`` wrote, read back: the mission as meant, the plan, and the polynomials that will be flown.

    in   the folder's path
    out  Reopened, or what stands in the way
    says MC708, and what the files in it deserve

Nothing but the folder's own files is read, and none of them is believed:
whoever wants to know whether they belong together asks ``differing``, whoever
wants to know whether the plan is right has it verified.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from missionc.checking import ANY_BACKEND, check
from missionc.diagnostics.code import FOLDER_UNREADABLE
from missionc.diagnostics.model import Diagnostic
from missionc.file_names import MISSION, file_names, polynomials_file
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.limits import Limits
from missionc.plan import Trace
from missionc.reading import read_bytes
from missionc.results import Checked
from missionc.source import Source
from missionc.traces import read_trace
from missionc.vehicles import profiles

MANIFEST, PLAN, CERTIFICATE = "manifest.json", "plan.json", "certificate.json"
STRETCH, VEHICLE = "stretch", "vehicle"
MOST_FILES = 100_000


@dataclass(frozen=True, slots=True, eq=False)
class Reopened:
    """What a folder holds.

    Args:
        path: the folder.
        manifest: what its ``manifest.json`` says.
        files: every file that the manifest lists, by its name relative to the folder.
        differing: the names of those whose content is not what the manifest says.
        checked: its mission, without an error.
        trace: its plan.
        flights: the text of each agent's polynomials, by the agent's name; empty where the file is missing.
    """

    path: Path
    manifest: Mapping[str, object]
    files: Mapping[str, bytes]
    differing: tuple[str, ...]
    checked: Checked
    mission: Mission
    kernel: Kernel
    trace: Trace
    flights: Mapping[str, str]


def reopen(folder: Path, limits: Limits | None = None) -> Reopened | tuple[Diagnostic, ...]:
    """The folder's mission, plan and polynomials; or every reason why they cannot be read."""
    limits = limits or Limits()
    manifest = _manifest(folder, limits)
    if isinstance(manifest, Diagnostic):
        return (manifest,)
    inputs, listed = _names(manifest.get("inputs")), _names(manifest.get("files"))
    if not inputs or PLAN not in listed:
        return (_unusable(folder, f"its `{MANIFEST}` names no mission and no `{PLAN}`"),)
    strange = next((name for name in (*inputs, *listed) if not _inside(name)), None)
    if strange is not None:
        return (_unusable(folder, f"its `{MANIFEST}` names `{strange}`, which does not lie in it"),)
    files: dict[str, bytes] = {}
    for name in listed:
        content = read_bytes(folder / name, str(folder / name), limits.trace_bytes, FOLDER_UNREADABLE)
        if isinstance(content, Diagnostic):
            return (content,)
        files[name] = content
    stretch = _stretch(manifest)
    if stretch is None:
        return (_unusable(folder, f"the `{STRETCH}` in its `{MANIFEST}` is no number from 1 on"),)
    vehicle = _option(manifest, VEHICLE, "")
    if vehicle and vehicle not in profiles():
        return (_unusable(folder, f"the `{VEHICLE}` in its `{MANIFEST}` is none that this version knows"),)
    checked = check(
        folder / MISSION / next(iter(inputs)),
        overrides=_overrides(manifest),
        backend=ANY_BACKEND,
        limits=limits,
        stretch=stretch,
        vehicle=vehicle,
    )
    if checked.mission is None or checked.kernel is None or not checked.ok:
        return checked.findings
    source = Source(str(folder / PLAN), files[PLAN].decode("utf-8", errors="replace"))
    trace, findings = read_trace(source, checked.mission)
    if trace is None:
        return tuple(findings)
    names = file_names(checked.mission.agents)
    return Reopened(
        path=folder,
        manifest=manifest,
        files=files,
        differing=tuple(name for name, content in files.items() if hashlib.sha256(content).hexdigest() != listed[name]),
        checked=checked,
        mission=checked.mission,
        kernel=checked.kernel,
        trace=trace,
        flights={
            agent.name: files.get(polynomials_file(names[agent.name]), b"").decode("utf-8", errors="replace")
            for agent in checked.mission.agents
        },
    )


def _manifest(folder: Path, limits: Limits) -> dict[str, object] | Diagnostic:
    """The manifest, of whatever shape within."""
    if not folder.is_dir():
        return _unusable(folder, "it is no folder")
    path = folder / MANIFEST
    if not path.exists():
        return _unusable(folder, f"there is no `{MANIFEST}` in it")
    content = read_bytes(path, str(path), limits.trace_bytes, FOLDER_UNREADABLE)
    if isinstance(content, Diagnostic):
        return content
    try:
        manifest = json.loads(content)
    except (ValueError, RecursionError):
        manifest = None
    if not isinstance(manifest, dict) or manifest.get("schema") != "missionc.manifest/1":
        return _unusable(folder, f"its `{MANIFEST}` is not what this version of the compiler writes")
    return manifest


def _names(listed: object) -> dict[str, str]:
    """Names and hashes; empty where something else stands there."""
    if not isinstance(listed, dict) or len(listed) > MOST_FILES:
        return {}
    return {name: value for name, value in listed.items() if isinstance(value, str)}


def _inside(name: str) -> bool:
    path = PurePosixPath(name)
    return bool(name) and not path.is_absolute() and ".." not in path.parts and "\0" not in name


def _stretch(manifest: Mapping[str, object]) -> float | None:
    """How much slower than planned the plan is; None where something else stands there."""
    try:
        stretch = float(_option(manifest, STRETCH, "1"))
    except ValueError:
        return None
    return stretch if 1 <= stretch < math.inf else None


def _option(manifest: Mapping[str, object], name: str, otherwise: str) -> str:
    """What the command line gave, as text."""
    return str(_options(manifest).get(name, otherwise))


def _overrides(manifest: Mapping[str, object]) -> dict[str, str]:
    """The parameters that the command line gave: the options that begin with ``-D``."""
    return {name[3:]: str(text) for name, text in _options(manifest).items() if name.startswith("-D ")}


def _options(manifest: Mapping[str, object]) -> dict[str, object]:
    options = manifest.get("options")
    return options if isinstance(options, dict) else {}


def _unusable(folder: Path, why: str) -> Diagnostic:
    return Diagnostic(
        FOLDER_UNREADABLE,
        f"`{folder}` is no folder that `missionc compile` wrote: {why}",
        None,
        help="name a folder written by `missionc compile`; an older one has to be compiled again",
    )
