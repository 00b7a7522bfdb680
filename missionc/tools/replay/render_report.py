"""Report drawn again from a folder's files, and simulated flights added to the folder.

in   Reverified; or a folder and the text of a simulation
out  the page's bytes; the folder with both, and with a manifest that lists them
says MC701 MC708, and errors of writing
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from missionc.base.diagnostics.code import OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.output.folder.file_names import MANIFEST, REPORT, SIMULATION
from missionc.output.folder.manifest import relisted
from missionc.output.folder.ownership import shown
from missionc.output.folder.write_file import write_inside
from missionc.output.folder.write_folder import refuse, write_folder
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.rebuild.alternatives import table_of
from missionc.tools.replay.rebuild.rebuild_documents import page
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
