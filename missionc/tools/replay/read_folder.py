"""Reader of a plan folder: its files by the manifest, the complete mission, the plan and its polynomials.

    in   the folder's path
    out  FolderFiles, then OutputFolder, or the obstacle
    says MC004 MC708, and the findings on the files in it

Only the folder's own files are read, each once and without symbolic links, and none of them is trusted. Rebuilding
tests whether they belong together; verification tests whether the plan is right.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from missionc.backends.options import SLOWEST
from missionc.base.diagnostics.code import FOLDER_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.extensions import installed
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.strict_json import NotJsonError, parse_json, parse_record
from missionc.base.trace import Trace
from missionc.compiler.front_end import ANY_BACKEND, Checked, check
from missionc.compiler.provenance import POSES
from missionc.compiler.remaining import remaining
from missionc.frontend.syntax.read_file import cannot_read, data_of, held, too_large
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.vehicle_profiles import profiles
from missionc.ir.wording import listed
from missionc.output.documents.whole_flight_json import ways_in
from missionc.output.folder import file_names
from missionc.output.folder.manifest import PACKAGES
from missionc.output.folder.ownership import MOST_ENTRIES, contents, is_normal, kind, printable, read_inside
from missionc.planning.progression.past_document import read_past
from missionc.verification.certificate import Check
from missionc.verification.flight.way_missions import Ways
from missionc.verification.monitoring.read_trace import read_trace

STRETCH, VEHICLE = "stretch", "vehicle"
"""Names of the options for the time scale and the vehicle in the manifest."""

UNLISTED = "not listed in the manifest"


class Listed(Protocol):
    """Folder contents: the listed files, those of them that differ from the manifest, and unlisted files."""

    @property
    def files(self) -> Mapping[str, bytes]: ...

    @property
    def differing(self) -> tuple[str, ...]: ...

    @property
    def unlisted(self) -> tuple[str, ...]: ...


@dataclass(frozen=True, slots=True, eq=False)
class FolderFiles:
    """Contents of a folder that the compiler wrote.

    Args:
        path: path of the folder.
        manifest: contents of ``manifest.json``; its ``inputs`` and ``files`` are names and texts.
        lying: status of every file and folder in it, by relative name.
        files: contents of every file that the manifest lists, including its mission's.
    """

    path: Path
    manifest: Mapping[str, object]
    lying: Mapping[str, os.stat_result]
    files: Mapping[str, bytes]

    @property
    def differing(self) -> tuple[str, ...]:
        """Names of the files whose contents differ from the manifest."""
        listed = names_and_hashes(self.manifest["files"])
        return tuple(name for name in self.files if listed.get(name) != hashlib.sha256(self.files[name]).hexdigest())

    @property
    def unlisted(self) -> tuple[str, ...]:
        """Names of unlisted files, and of folders without listed files."""
        return unlisted_of(self.lying, [*self.files, file_names.MANIFEST])


def read_files(folder: Path, limits: Limits, wanted: str) -> FolderFiles | Diagnostic:
    """Read the listed files of a folder, or return the reason why it is unreadable.

    Args:
        folder: path of the folder.
        limits: maximum sizes of the files.
        wanted: name of a file that must be among them.
    """
    lying = lying_in(folder, limits)
    if isinstance(lying, Diagnostic):
        return lying
    manifest = manifest_in(folder, limits)
    if isinstance(manifest, Diagnostic):
        return manifest
    inputs, listed = names_and_hashes(manifest.get("inputs")), names_and_hashes(manifest.get("files"))
    if not inputs or wanted not in listed:
        return unusable(folder, f"its `{file_names.MANIFEST}` names neither a mission nor `{wanted}`")
    missions = [f"{file_names.MISSION}/{name}" for name in inputs]
    wrong = _misspelt(listed) or _misspelt(inputs) or _absent(lying, [*listed, *missions])
    if wrong:
        return unusable(folder, f"its `{file_names.MANIFEST}` names {wrong}")
    files: dict[str, bytes] = {}
    for name in dict.fromkeys((*listed, *missions)):
        content = read_inside(folder, name, limits.trace_bytes)
        if isinstance(content, Diagnostic):
            return content
        files[name] = content
    return FolderFiles(folder, manifest, lying, files)


def file_checks(found: Listed) -> tuple[Check, ...]:
    """Checks that every listed file is unchanged and that there are no others."""
    detail = "the SHA-256 matches the manifest"
    listed = (
        Check("manifest", name, 0.0, "", 0.0, name not in found.differing, detail=detail)
        for name in sorted(found.files)
    )
    beside = (Check("manifest", name, 0.0, "", 0.0, False, detail=UNLISTED) for name in found.unlisted)
    return (*listed, *beside)


def check_mission(found: FolderFiles, limits: Limits, *, of_plan: bool = True) -> Checked | Diagnostic:
    """Check the mission in a folder with the options of its manifest; return an error in the manifest, if any.

    Args:
        found: contents of the folder.
        limits: maximum sizes of the mission.
        of_plan: whether to use the duration of the plan in the folder, which may be longer than the mission's.
    """
    folder, inputs = found.path, names_and_hashes(found.manifest["inputs"])
    stretch = _stretch(found.manifest)
    if stretch is None:
        return unusable(folder, f"the `{STRETCH}` in its `{file_names.MANIFEST}` is not a number from 1 to {SLOWEST:g}")
    vehicle = option(found.manifest, VEHICLE) or ""
    if vehicle and vehicle not in profiles():
        return unusable(folder, f"the `{VEHICLE}` in its `{file_names.MANIFEST}` is unknown to this version")
    own = {name: found.files[f"{file_names.MISSION}/{name}"] for name in inputs}
    poses = _poses(found, own_names=inputs)
    if isinstance(poses, Diagnostic):
        return poses
    source, load = held(next(iter(inputs)), str(folder / file_names.MISSION), own, limits)
    if isinstance(source, Diagnostic):
        return source
    lasting = stretch if of_plan else 1.0
    checked = check(
        source,
        overrides=_overrides(found.manifest),
        backend=ANY_BACKEND,
        limits=limits,
        stretch=lasting,
        vehicle=vehicle,
        poses=poses,
        load=load,
        begun=file_names.PAST in found.files,
    )
    if not checked.ok and (absent := _absent_packages(found.manifest)):
        message = f"`{printable(str(folder))}` needs a package that is not installed: {listed(absent)}"
        return Diagnostic(FOLDER_UNREADABLE, message, None, help="install it, in this version")
    if file_names.PAST not in found.files or checked.mission is None or checked.kernel is None:
        return checked
    return _rest(found, checked, limits)


def _rest(found: FolderFiles, checked: Checked, limits: Limits) -> Checked | Diagnostic:
    """Remaining mission after its flown part, or the error in the file of that part."""
    past = read_past(found.files[file_names.PAST].decode("utf-8", errors="replace"), limits.magnitude)
    if isinstance(past, str):
        return unusable(found.path, f"invalid `{file_names.PAST}`: {past}")
    return remaining(checked, past, limits)


def _poses(found: FolderFiles, own_names: Mapping[str, str]) -> Source | Diagnostic | None:
    """File of measured positions that the manifest names; None without one; an error if it is not an input."""
    name = option(found.manifest, POSES)
    if name is None:
        return None
    if name not in own_names:
        return unusable(found.path, f"the `{POSES}` in its `{file_names.MANIFEST}` is not one of its inputs")
    return data_of(found.files[f"{file_names.MISSION}/{name}"], str(found.path / file_names.MISSION / name))


# ------------------------------------------------------------------ what lies there


def lying_in(folder: Path, limits: Limits) -> dict[str, os.stat_result] | Diagnostic:
    """Status of every file and folder in a folder by relative name, or the finding that it has a link or is too
    large.
    """
    if not folder.is_dir():
        return unusable(folder, "it is not a folder")
    try:
        lying = contents(folder)
    except OSError as error:
        return cannot_read(FOLDER_UNREADABLE, printable(str(folder)), error)
    if file_names.MANIFEST not in lying:
        return unusable(folder, f"it has no `{file_names.MANIFEST}`")
    if len(lying) > MOST_ENTRIES:
        return unusable(folder, f"it has more than {MOST_ENTRIES} files")
    for name in sorted(lying):
        if kind(lying[name]):
            return unusable(folder, f"its `{printable(name)}` is {kind(lying[name])}")
    size = sum(status.st_size for status in lying.values() if stat.S_ISREG(status.st_mode))
    if size > limits.trace_bytes:
        return too_large(FOLDER_UNREADABLE, printable(str(folder)), size, limits.trace_bytes)
    return lying


def _misspelt(names: Iterable[str]) -> str:
    """First name that is not in normal form, or that equals another one except for case; empty if there is none."""
    seen: dict[str, str] = {}
    for name in names:
        if not is_normal(name):
            return f"`{name}`, which is not a normalized name"
        before = seen.setdefault(name.casefold(), name)
        if before != name:
            return f"`{name}` and `{before}`, which differ only in case"
    return ""


def _absent(lying: Mapping[str, os.stat_result], names: Sequence[str]) -> str:
    """First name without a regular file in the folder, with the reason; empty if there is none."""
    for name in names:
        if name not in lying or not stat.S_ISREG(lying[name].st_mode):
            return f"`{name}`, which is missing"
    return ""


def unlisted_of(lying: Iterable[str], names: Iterable[str]) -> tuple[str, ...]:
    """Sorted names in the folder that are not among the given files."""
    return tuple(sorted(set(lying) - set(names)))


# ---------------------------------------------------------------------- the manifest


def manifest_in(folder: Path, limits: Limits) -> dict[str, object] | Diagnostic:
    """Contents of the manifest as parsed JSON, or the finding that it is unreadable; entries are not checked here."""
    content = read_inside(folder, file_names.MANIFEST, limits.trace_bytes)
    return content if isinstance(content, Diagnostic) else parsed(folder, content)


def parsed(folder: Path, content: bytes) -> dict[str, object] | Diagnostic:
    try:
        return parse_record(content, file_names.MANIFEST_SCHEMA)
    except NotJsonError as error:
        return unusable(folder, f"its `{file_names.MANIFEST}` cannot be read: {error.reason}")


def names_and_hashes(listed: object) -> dict[str, str]:
    """Hashes by name from an entry of the manifest; empty if it is malformed."""
    if not isinstance(listed, dict) or not all(isinstance(value, str) for value in listed.values()):
        return {}
    return listed


def option(manifest: Mapping[str, object], name: str) -> str | None:
    """Value of a command-line option in the manifest; None if it was not given or is not a text."""
    value = options(manifest).get(name)
    return value if isinstance(value, str) else None


def options(manifest: Mapping[str, object]) -> dict[str, object]:
    """All command-line options in the manifest, by name."""
    given = manifest.get("options")
    return given if isinstance(given, dict) else {}


def _stretch(manifest: Mapping[str, object]) -> float | None:
    """Time scale of the plan; 1 if the manifest states none; None if it is malformed."""
    if STRETCH not in options(manifest):
        return 1.0
    try:
        stretch = float(option(manifest, STRETCH) or "")
    except ValueError:
        return None
    return stretch if 1 <= stretch <= SLOWEST else None


def _absent_packages(manifest: Mapping[str, object]) -> list[str]:
    """Names and versions of extension packages in the manifest that are not installed."""
    known = {"missionc", "python", *PACKAGES, *(each.package for each in installed())}
    versions = names_and_hashes(manifest.get("versions"))
    return [f"`{printable(name)}` {printable(number)}" for name, number in versions.items() if name not in known]


def _overrides(manifest: Mapping[str, object]) -> dict[str, str]:
    """Values of parameters and settings from ``-D`` and ``--set`` in the manifest, by name."""
    given = ((*name.partition(" "), text) for name, text in options(manifest).items())
    return {name: text for flag, _, name, text in given if flag in ("-D", "--set") and isinstance(text, str)}


def unusable(folder: Path, why: str) -> Diagnostic:
    return Diagnostic(
        FOLDER_UNREADABLE,
        f"`{printable(str(folder))}` is not a plan folder: {why}",
        None,
        help="name a folder written by this version of `missionc compile`",
    )


PLAN, CERTIFICATE = "plan.json", "certificate.json"


@dataclass(frozen=True, eq=False)
class OutputFolder:
    """Plan folder with all of its contents.

    Args:
        path: path of the folder.
        manifest: contents of ``manifest.json``; its ``inputs`` and ``files`` are names and texts.
        files: contents of every file that the manifest lists, by relative name.
        differing: names of the files whose contents differ from the manifest.
        unlisted: other files in the folder, and folders without listed files.
        checked: its mission, without errors.
        mission, kernel: the mission in both representations.
        trace: its plan.
        flights: text of each agent's polynomials by agent name; empty if the file is missing.
        ways: texts of the transfers from and to the floor that have a file in the folder.
        alternatives: folders of further plans in it, by relative name.
    """

    path: Path
    manifest: Mapping[str, object]
    files: Mapping[str, bytes]
    differing: tuple[str, ...]
    unlisted: tuple[str, ...]
    checked: Checked
    mission: Mission
    kernel: Kernel
    trace: Trace
    flights: Mapping[str, str]
    ways: Ways = field(default_factory=dict)
    alternatives: Mapping[str, OutputFolder] = field(default_factory=dict)

    @property
    def stops(self) -> Mapping[str, str]:
        """Text of each agent's trajectory until the start of the plan, by agent name; empty if there is none."""
        return file_names.stops_in(self.mission.agents, self.files)

    @property
    def in_flight(self) -> bool:
        """Return whether the plan starts in the air, after an earlier flight."""
        return file_names.PAST in self.files

    @cached_property
    def plan_document(self) -> Any:
        """Parsed contents of ``plan.json``; its numbers need not be finite."""
        return parse_json(self.text(PLAN), finite=False)

    def text(self, name: str) -> str:
        """Contents of a file as text; empty if there is no such file."""
        return self.files.get(name, b"").decode("utf-8", errors="replace")


def read_folder(folder: Path, limits: Limits | None = None) -> OutputFolder | tuple[Diagnostic, ...]:
    """Read the mission, the plan and the polynomials of a folder, or return all reasons why they are unreadable.

    Args:
        folder: path of the folder.
        limits: maximum sizes of the files; the defaults of ``Limits`` if None.
    """
    limits = limits or Limits()
    found = read_files(folder, limits, PLAN)
    if isinstance(found, Diagnostic):
        return (found,)
    opened = _read(found, limits)
    return _with_alternatives(opened, found.lying, limits) if isinstance(opened, OutputFolder) else opened


def _with_alternatives(
    opened: OutputFolder, lying: Mapping[str, os.stat_result], limits: Limits
) -> OutputFolder | tuple[Diagnostic, ...]:
    """Folder with the folders of further plans, read from the files in memory; all findings if one is unreadable."""
    inside: dict[str, OutputFolder] = {}
    for rank in range(2, file_names.MOST_ALTERNATIVES + 1):
        name = f"{file_names.ALTERNATIVES_FOLDER}/{rank}"
        own = {
            file.removeprefix(f"{name}/"): content
            for file, content in opened.files.items()
            if file.startswith(f"{name}/")
        }
        if file_names.MANIFEST not in own:
            continue
        path = opened.path / name
        manifest = parsed(path, own[file_names.MANIFEST])
        if isinstance(manifest, Diagnostic):
            return (manifest,)
        inputs, listed = names_and_hashes(manifest.get("inputs")), names_and_hashes(manifest.get("files"))
        there = {file.removeprefix(f"{name}/"): status for file, status in lying.items() if file.startswith(f"{name}/")}
        wanted = [*listed, *(f"{file_names.MISSION}/{file}" for file in inputs)]
        if not inputs or PLAN not in listed or any(file not in own for file in wanted):
            return (
                unusable(path, f"its `{file_names.MANIFEST}` has no mission, no `{PLAN}`, or files that are missing"),
            )
        files = {file: own[file] for file in dict.fromkeys(wanted)}
        read = _read(FolderFiles(path, manifest, there, files), limits)
        if not isinstance(read, OutputFolder):
            return read
        inside[name] = read
    return replace(opened, alternatives=inside)


def _read(found: FolderFiles, limits: Limits) -> OutputFolder | tuple[Diagnostic, ...]:
    """Plan folder from files in memory, or all reasons why they are unreadable."""
    folder, files = found.path, found.files
    checked = check_mission(found, limits)
    if isinstance(checked, Diagnostic):
        return (checked,)
    if checked.mission is None or checked.kernel is None or not checked.ok:
        return checked.findings
    plan = Source(str(folder / PLAN), files[PLAN].decode("utf-8", errors="replace"))
    trace, findings = read_trace(plan, checked.mission, limits)
    if trace is None:
        return tuple(findings)
    return OutputFolder(
        path=folder,
        manifest=found.manifest,
        files=files,
        differing=found.differing,
        unlisted=found.unlisted,
        checked=checked,
        mission=checked.mission,
        kernel=checked.kernel,
        trace=trace,
        flights=file_names.flights_in(checked.mission.agents, files),
        ways=ways_in(checked.mission, files),
    )
