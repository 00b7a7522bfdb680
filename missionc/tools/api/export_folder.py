"""Export of a plan folder: its flight in other formats, after re-verification.

in   the folder, the names of the formats
out  FolderExport
says MC404 MC703 MC709, and the codes of ``reverify`` and ``fly_from``
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.output.export.formats import FORMATS, flight
from missionc.output.folder.file_names import EXPORT, MANIFEST
from missionc.output.folder.manifest import without_plan
from missionc.tools.replay.reverify import Reverified, reverify


@dataclass(frozen=True, slots=True, eq=False)
class FolderExport:
    """Result of an export.

    Args:
        findings: errors and warnings.
        notes: remarks for the users of the files.
        files: contents by relative path; empty if there are findings.
        reverified: result of the preceding re-verification.
    """

    findings: tuple[Diagnostic, ...]
    notes: tuple[str, ...]
    files: dict[str, bytes]
    reverified: Reverified


def export_folder(folder: Path, names: Iterable[str], poses: Path | None, limits: Limits) -> FolderExport:
    """Verify a plan folder, and export its flight.

    Args:
        folder: path of the plan folder.
        names: format names, keys of ``output.export.formats.FORMATS``.
        poses: file of measured positions, from which the agents take off; None for the starts of the mission.
        limits: maximum sizes of the folder's files.
    """
    reverified = reverify(folder, limits)
    opened, findings = reverified.opened, list(reverified.findings)
    notes: list[str] = []
    files: dict[str, bytes] = {}
    flown = None
    if opened is not None and reverified.passed and poses is None:
        flown = flight(opened.mission, opened.kernel, opened.trace, opened.flights, opened.ways, opened.in_flight)
    elif opened is not None and reverified.passed and poses is not None:
        from missionc.compiler.fly_from import fly_from  # loads the planner

        answer = fly_from(opened.mission, opened.flights, opened.files["plan.json"], poses, limits)
        files |= dict(answer.files)
        if answer.whole is not None:
            flown = flight(answer.mission, opened.kernel, opened.trace, opened.flights, answer.whole.ways)
        notes += [each.message for each in answer.findings if files and each.code.warning]
        findings += [each for each in answer.findings if not (files and each.code.warning)]
    for name in dict.fromkeys(names):
        made = FORMATS[name].export(flown) if flown else None
        if isinstance(made, Diagnostic):
            findings.append(made)
        elif made is not None:
            files |= {f"{name}/{file}": content for file, content in made.files.items()}
            notes += made.notes
    if findings or opened is None:
        return FolderExport(tuple(findings), tuple(notes), {}, reverified)
    files[MANIFEST] = without_plan(opened.mission.name, EXPORT, files).encode()
    return FolderExport((), tuple(notes), files, reverified)
