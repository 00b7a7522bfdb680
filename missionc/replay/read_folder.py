"""Reader of an output folder: the mission as meant, the plan, and the polynomials that will be flown.

    in   the folder's path
    out  OutputFolder, or what stands in the way
    says MC004 MC708, and what the files in it deserve

Nothing but the folder's own files is read, each once and through no symbolic
link, and none of them is believed: whoever wants to know whether they belong
together has them rebuilt, whoever wants to know whether the plan is right has
it verified.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.monitoring.read_trace import read_trace
from missionc.output.documents.whole_flight_json import ways_in
from missionc.output.folder.file_names import (
    ALTERNATIVES_FOLDER,
    MANIFEST,
    MISSION,
    MOST_ALTERNATIVES,
    PAST,
    flights_in,
    stops_in,
)
from missionc.pipeline.checked import Checked
from missionc.replay.folder_files import FolderFiles, check_mission, names_and_hashes, parsed, read_files, unusable
from missionc.verify.flight.way_missions import Ways

PLAN, CERTIFICATE = "plan.json", "certificate.json"


@dataclass(frozen=True, slots=True, eq=False)
class OutputFolder:
    """An output folder, read: everything that it holds.

    Args:
        path: the folder.
        manifest: what its ``manifest.json`` says; its ``inputs`` and ``files`` are names and texts.
        files: every file that the manifest lists, by its name relative to the folder.
        differing: the names of those whose content is not what the manifest says.
        unlisted: what lies in the folder beside them, files and folders without any.
        checked: its mission, without an error.
        trace: its plan.
        flights: the text of each agent's polynomials, by the agent's name; empty where the file is missing.
        ways: likewise of the ways from the floor and back to it, those that the folder holds any file of.
        alternatives: the folders of further plans in it, by their names relative to it.
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
        """The text of what each agent flies until the plan begins, by the agent's name; empty where that is nothing."""
        return stops_in(self.mission.agents, self.files)

    @property
    def in_flight(self) -> bool:
        """Whether the plan begins in the air: something was flown before it."""
        return PAST in self.files

    def text(self, name: str) -> str:
        """A file as text; empty where there is none."""
        return self.files.get(name, b"").decode("utf-8", errors="replace")


def read_folder(folder: Path, limits: Limits | None = None) -> OutputFolder | tuple[Diagnostic, ...]:
    """The folder's mission, plan and polynomials; or every reason why they cannot be read."""
    limits = limits or Limits()
    found = read_files(folder, limits, PLAN)
    if isinstance(found, Diagnostic):
        return (found,)
    opened = _read(found, limits)
    return _with_alternatives(opened, found.lying, limits) if isinstance(opened, OutputFolder) else opened


def _with_alternatives(
    opened: OutputFolder, lying: Mapping[str, os.stat_result], limits: Limits
) -> OutputFolder | tuple[Diagnostic, ...]:
    """The folder with those of further plans, each read from the files that are in hand."""
    inside: dict[str, OutputFolder] = {}
    for rank in range(2, MOST_ALTERNATIVES + 1):
        name = f"{ALTERNATIVES_FOLDER}/{rank}"
        own = {
            file.removeprefix(f"{name}/"): content
            for file, content in opened.files.items()
            if file.startswith(f"{name}/")
        }
        if MANIFEST not in own:
            continue
        path = opened.path / name
        manifest = parsed(path, own[MANIFEST])
        if isinstance(manifest, Diagnostic):
            return (manifest,)
        inputs, listed = names_and_hashes(manifest.get("inputs")), names_and_hashes(manifest.get("files"))
        there = {file.removeprefix(f"{name}/"): status for file, status in lying.items() if file.startswith(f"{name}/")}
        wanted = [*listed, *(f"{MISSION}/{file}" for file in inputs)]
        if not inputs or PLAN not in listed or any(file not in own for file in wanted):
            return (unusable(path, f"its `{MANIFEST}` names no mission, no `{PLAN}`, or files that are not in it"),)
        files = {file: own[file] for file in dict.fromkeys(wanted)}
        read = _read(FolderFiles(path, manifest, there, files), limits)
        if not isinstance(read, OutputFolder):
            return read
        inside[name] = read
    return replace(opened, alternatives=inside)


def _read(found: FolderFiles, limits: Limits) -> OutputFolder | tuple[Diagnostic, ...]:
    """The same, of files that are in hand."""
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
        flights=flights_in(checked.mission.agents, files),
        ways=ways_in(checked.mission, files),
    )
