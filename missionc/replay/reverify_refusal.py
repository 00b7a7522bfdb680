"""Verification of a folder that holds a proof that there is no plan, from its files alone.

in   the folder's path
out  Reverified: every check of the proof, and what it proves
says MC714
"""

from __future__ import annotations

from pathlib import Path

from missionc.base.limits import Limits
from missionc.diagnostics.code import PROVES_NOTHING
from missionc.diagnostics.model import Diagnostic
from missionc.ir.wording import all_listed
from missionc.output.folder.file_names import PROOF
from missionc.output.folder.walk_folder import printable
from missionc.replay.folder_files import (
    UNLISTED,
    FolderFiles,
    check_mission,
    file_checks,
    manifest_in,
    options,
    read_files,
)
from missionc.replay.rebuild.manifest_entries import check_manifest_of_proof
from missionc.replay.reverify import Reverified
from missionc.verify.certificate import Certificate, Check
from missionc.verify.impossibility.check_refutation import CNF, check_drat, check_refutation, conflict_of
from missionc.verify.impossibility.cover_document import COVER


def reverify_refusal(folder: Path, limits: Limits | None = None) -> Reverified | None:
    """Judge the proof that a folder holds; None where it is not of that kind."""
    limits = limits or Limits()
    manifest = manifest_in(folder, limits)
    if isinstance(manifest, Diagnostic) or manifest.get("holds") != PROOF:
        return None
    found = read_files(folder, limits, CNF)
    if isinstance(found, Diagnostic):
        return Reverified(folder, (found,))
    checked = check_mission(found, limits, of_plan=False)
    if isinstance(checked, Diagnostic):
        return Reverified(folder, (checked,))
    mission, kernel = checked.mission, checked.kernel
    if mission is None or kernel is None:
        return Reverified(folder, checked.findings)
    of_cover = COVER in found.files
    judged = check_refutation(mission, kernel, found.files, limits) if of_cover else (check_drat(found.files, limits),)
    files = (*file_checks(found), *check_manifest_of_proof(found, checked, mission.name))
    certificate = Certificate(mission.name, (*files, *judged))
    findings = () if certificate.passed else (_refused(found, certificate),)
    proven = _proven(conflict_of(found.files, mission) if of_cover else None) + _given(found)
    return Reverified(folder, findings, certificate=certificate, proven=proven if certificate.passed else "")


def _proven(conflict: tuple[str, ...] | None) -> str:
    if conflict is None:
        return f"the clauses in `{CNF}` cannot all hold; that a roadmap and the mission ask for them is not checked"
    names = all_listed([f"`{name}`" for name in conflict])
    if not conflict:
        return "no motion of these agents is a plan, whatever the requirements"
    return f"no motion of these agents satisfies {names}{' together' if len(conflict) > 1 else ''}"


def _given(found: FolderFiles) -> str:
    """What the command line changed of the mission, for whoever reads the mission and not the manifest."""
    given = [f"{name}={value}" for name, value in options(found.manifest).items() if name.startswith("-D ")]
    return f", with {all_listed([f'`{each}`' for each in given])}" if given else ""


def _refused(found: FolderFiles, certificate: Certificate) -> Diagnostic:
    failures = certificate.failures
    return Diagnostic(
        PROVES_NOTHING,
        f"`{printable(str(found.path))}` proves nothing: {len(failures)} of {len(certificate.checks)} checks fail",
        None,
        notes=tuple(map(_reason, failures[:8])),
        help="compile the mission again with `--certify`; files that were changed by hand prove nothing any more",
    )


def _reason(check: Check) -> str:
    if check.name == "manifest":
        why = check.detail if check.detail == UNLISTED else "its content is not the one that was written"
        return f"file `{printable(check.subject)}`: {why}"
    return f"{check.name} of {printable(check.subject)}: {check.detail}"
