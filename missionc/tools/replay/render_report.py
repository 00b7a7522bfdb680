"""Report drawn again from a folder's files, and simulated flights added to the folder.

in   Reverified; or a folder and the text of a simulation
out  the page's bytes; the folder with both, and with a manifest that lists them
says MC701 MC708, and errors of writing

Report that compares two plans of one mission: both on one page, with one time line.

in   two Reverified
out  the page's bytes, or the reason why they are plans of different missions
says MC716
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path

from missionc.base.diagnostics.code import NOT_ONE_MISSION, OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.compiler.provenance import texts
from missionc.output.folder.file_names import MANIFEST, REPORT, SIMULATION
from missionc.output.folder.manifest import relisted
from missionc.output.folder.ownership import shown
from missionc.output.folder.write_folder import refuse, write_folder, write_inside
from missionc.output.report.report_html import report
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.rebuild.alternatives import table_of
from missionc.tools.replay.rebuild.rebuild_documents import page, plotted
from missionc.tools.replay.reverify import Reverified, plans_of, reverify_opened


def render_report(reverified: Reverified) -> bytes:
    """Report page of a re-verified folder; empty if the folder is unreadable.

    The page shows failed checks, except those of the page that it replaces.
    """
    opened, certificate, flown = reverified.opened, reverified.certificate, reverified.flown
    if opened is None or certificate is None or flown is None:
        return b""
    sound = all(check.passed or check.subject == REPORT for check in certificate.checks)
    judged = plans_of(reverified.others)
    return page(opened, flown if sound else certificate, None, judged, table_of(opened, flown, judged))


def add_simulation(folder: Path, simulation: bytes, limits: Limits | None = None) -> tuple[Diagnostic, ...]:
    """Write a simulation and its report to a folder, and list both; other entries of the manifest stay unchanged.

    The complete folder is replaced if all of its contents are the compiler's, so that all three files change or none.
    Otherwise, or if the parent folder is not writable, they are written one by one. Files changed by hand still count
    as changed. A changed simulation or page is not replaced.

    Args:
        folder: path of the plan folder.
        simulation: contents of ``simulation.json``.
        limits: maximum sizes of the files; the defaults of ``Limits`` if None.

    Returns:
        The errors; empty if the files were written.
    """
    before = read_folder(folder, limits)
    if not isinstance(before, OutputFolder):
        return before
    strange = next((name for name in (SIMULATION, REPORT) if _foreign(before, name)), None)
    if strange:
        return (_left_alone(folder / strange),)
    with_it = _with_simulation(before, simulation)
    drawn = render_report(reverify_opened(with_it, None))
    listing = relisted(with_it.manifest, {REPORT: drawn})
    new = {SIMULATION: simulation, REPORT: drawn, MANIFEST: listing}
    wrong = _replaced(before, new) if _replaceable(before) else _one_by_one(folder, new)
    return (wrong,) if wrong else ()


def _with_simulation(opened: OutputFolder, simulation: bytes) -> OutputFolder:
    """Folder in memory with the simulation among its files and in its manifest."""
    manifest = json.loads(relisted(opened.manifest, {SIMULATION: simulation}))
    differing = tuple(name for name in opened.differing if name != SIMULATION)
    return replace(opened, manifest=manifest, files={**opened.files, SIMULATION: simulation}, differing=differing)


def _replaceable(opened: OutputFolder) -> bool:
    """Return whether the complete folder may be replaced: it is not in use, and all contents are the compiler's."""
    works_in_it = Path(os.path.realpath(os.curdir)).is_relative_to(os.path.realpath(opened.path))
    return not works_in_it and refuse(opened.path, force=True) is None


def _replaced(opened: OutputFolder, new: Mapping[str, bytes]) -> Diagnostic | None:
    return write_folder(opened.path, {**opened.files, **new}.items(), force=True)


def _one_by_one(folder: Path, new: Mapping[str, bytes]) -> Diagnostic | None:
    """Write files one by one; return the first error, if any.

    The manifest is last, so that unlisted files stay detectable.
    """
    return next(filter(None, (write_inside(folder, name, content) for name, content in new.items())), None)


def _foreign(opened: OutputFolder, name: str) -> bool:
    """Return whether a file differs from the manifest or is not listed there."""
    path = opened.path / name
    if path.is_symlink():
        return True
    return os.path.lexists(path) and (name not in opened.files or name in opened.differing)


def _left_alone(path: Path) -> Diagnostic:
    return Diagnostic(
        OUTPUT_EXISTS,
        f"`{shown(path)}` exists and was not written by the compiler",
        None,
        notes=("the flight was not added to the folder",),
        help="move the file out of the folder and compile the mission again",
    )


def compare_reports(first: Reverified, second: Reverified) -> bytes | Diagnostic:
    """Report page of two plans, or the finding that they belong to different missions.

    Args:
        first, second: re-verified, readable folders, shown as A and B.
    """
    assert first.opened is not None
    assert second.opened is not None
    different = _difference(first.opened, second.opened)
    if different:
        return Diagnostic(
            NOT_ONE_MISSION,
            f"`{first.folder}` and `{second.folder}` are plans of different missions",
            None,
            notes=(different,),
            help="name two plan folders of the same mission",
        )
    plots = [plotted(each.opened, each.certificate) for each in (first, second) if each.opened and each.certificate]
    names = _short_names(first.folder, second.folder)
    return report(plots[0], compared=(names, plots[1]))


def _short_names(first: Path, second: Path) -> tuple[str, str]:
    """Names of two folders for display; their paths if the names are equal."""
    if first.name != second.name:
        return first.name, second.name
    return str(first), str(second)


def _difference(first: OutputFolder, second: OutputFolder) -> str:
    """First difference between the missions of two folders in words; empty if they are equal."""
    if first.mission.name != second.mission.name:
        return f"the first is a plan of `{first.mission.name}`, the second of `{second.mission.name}`"
    ours, theirs = texts(first.checked), texts(second.checked)
    # The mission's own file may have had another name.
    if [name for name, _ in ours[1:]] != [name for name, _ in theirs[1:]]:
        return f"the first has the files {_listed(ours)}, the second {_listed(theirs)}"
    for (name, text), (_, changed) in zip(ours, theirs, strict=True):
        for number, (one, other) in enumerate(zip_longest(text.splitlines(), changed.splitlines()), 1):
            if one != other:
                return f"line {number} of `{name}`: {_quoted(one)} in the first, {_quoted(other)} in the second"
    return _of_values(first, second)


def _of_values(first: OutputFolder, second: OutputFolder) -> str:
    """Difference in the length or the agents of two missions, which command-line values cause.

    Empty if there is none.
    """
    ours, theirs = first.mission, second.mission
    if (ours.step, ours.steps) != (theirs.step, theirs.steps):
        times = [f"{mission.steps} steps of {mission.step:g} s" for mission in (ours, theirs)]
        return f"the first lasts {times[0]}, the second {times[1]}"
    names = [", ".join(agent.name for agent in mission.agents) for mission in (ours, theirs)]
    return "" if names[0] == names[1] else f"the first has the agents {names[0]}, the second {names[1]}"


def _listed(files: tuple[tuple[str, str], ...]) -> str:
    return ", ".join(f"`{name}`" for name, _ in files)


def _quoted(line: str | None) -> str:
    return "nothing" if line is None else f"`{' '.join(line.split())}`"
