"""Re-verification of a folder from its files alone: of a plan, or of a proof that none exists.

    in   OutputFolder, or the path of a folder with a proof
    out  Reverified: the Certificate of the files, and that of the plan and its flight; or the checks of the proof, and
    its statement
    says MC709 MC713 MC714

No backend and no polynomial fit is imported here.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from missionc.base.diagnostics.code import FOLDER_REFUSED, NOT_JUDGED, PROVES_NOTHING
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.compiler.remaining import stops_of, whole_checks
from missionc.ir.wording import all_listed
from missionc.output.documents.safe_end_json import read_safe_end
from missionc.output.folder.file_names import PROOF, SAFE_END
from missionc.output.folder.ownership import printable
from missionc.tools.replay.read_folder import (
    CERTIFICATE,
    PLAN,
    UNLISTED,
    FolderFiles,
    OutputFolder,
    check_mission,
    file_checks,
    manifest_in,
    options,
    read_files,
    read_folder,
)
from missionc.tools.replay.rebuild.alternatives import Judged
from missionc.tools.replay.rebuild.manifest_entries import check_manifest_of_proof
from missionc.tools.replay.rebuild.rebuild_documents import check_documents
from missionc.tools.replay.rebuild.verdict import DOCUMENT, UNJUDGED, unjudged, verdict
from missionc.verification.certificate import Certificate, Check
from missionc.verification.check_certificate import check_certificate
from missionc.verification.flight.verify_safe_end import has_safe_end, verify_safe_end
from missionc.verification.flight.verify_stops import verify_stops
from missionc.verification.flight.verify_whole_flight import as_one, verify_whole_flight
from missionc.verification.flight.way_missions import is_whole
from missionc.verification.impossibility.check_refutation import CNF, check_drat, check_refutation, conflict_of
from missionc.verification.impossibility.cover_document import COVER
from missionc.verification.verify_plan import verify, verify_between, verify_polynomials, with_delays

MOST_REASONS = 8
"""Maximum number of failed checks that a message states."""


@dataclass(frozen=True, slots=True, eq=False)
class Reverified:
    """Result of the verification of a folder.

    Args:
        folder: path of the folder.
        findings: errors; empty if all checks pass.
        opened: contents of the folder; None if they are unreadable.
        certificate: all checks; None if the files are unreadable.
        flown: checks of the plan and its flight, without those of files.
    """

    folder: Path
    findings: tuple[Diagnostic, ...]
    opened: OutputFolder | None = None
    certificate: Certificate | None = None
    flown: Certificate | None = None
    others: tuple[Reverified, ...] = ()
    """Results for further plans in the folder, by rank."""
    proven: str = ""
    """Statement that the files prove, for a folder with a proof instead of a plan; otherwise empty."""

    @property
    def passed(self) -> bool:
        return self.certificate is not None and self.certificate.passed

    @property
    def undecided(self) -> bool:
        """Return whether all failed checks are of parts that cannot be verified here."""
        return self.certificate is not None and _undecided(self.certificate)


def reverify(folder: Path, limits: Limits | None = None) -> Reverified:
    """Verify the plan and the polynomials in a folder, and all of its other contents.

    Args:
        folder: path of the folder.
        limits: maximum sizes of the files; the defaults of ``Limits`` if None.
    """
    opened = read_folder(folder, limits)
    return (
        reverify_opened(opened, limits or Limits()) if isinstance(opened, OutputFolder) else Reverified(folder, opened)
    )


def reverify_opened(opened: OutputFolder, limits: Limits | None) -> Reverified:
    """Verify a folder in memory.

    Args:
        opened: contents of the folder.
        limits: maximum sizes; if None, simulations are not repeated.
    """
    others = tuple(reverify_opened(each, limits) for each in opened.alternatives.values())
    mission, kernel, trace = opened.mission, opened.kernel, opened.trace
    flown = verify(mission, kernel, trace)
    whole = whole_checks(opened.checked.rest, trace)
    flown = flown if whole is None or not flown.passed else flown.joined(whole)
    if flown.passed:
        flown = with_delays(mission, kernel, trace, flown)
        flown = flown.joined(verify_polynomials(mission, kernel, trace, opened.flights))
    stops = stops_of(opened.checked, opened.stops)
    if flown.passed and stops is not None:
        flown = flown.joined(verify_stops(stops))
    if flown.passed and is_whole(mission):
        flown = flown.joined(verify_whole_flight(mission, opened.flights, opened.ways))
    if flown.passed and has_safe_end(mission):
        flown = flown.joined(_safe_end(opened))
    documents: tuple[Check, ...] = ()
    if flown.passed:
        flown = flown.joined(verify_between(mission, kernel, trace, opened.flights))
        documents = (*_stated(opened, flown), *check_documents(opened, flown, limits, plans_of(others)))
    certificate = Certificate(mission.name, file_checks(opened)).joined(flown)
    certificate = certificate.joined(
        Certificate(mission.name, (*documents, *map(_of_other, opened.alternatives, others)))
    )
    say = _not_judged if _undecided(certificate) else _plan_refused
    findings = () if certificate.passed else (say(opened.path, certificate),)
    return Reverified(opened.path, findings, opened, certificate, flown, others)


def _safe_end(opened: OutputFolder) -> Certificate:
    """Certificate of the safe ends of a flight."""
    mission = opened.mission
    stops = read_safe_end(opened.text(SAFE_END), mission)
    if isinstance(stops, str):
        return Certificate(mission.name, (Check("safe end file", SAFE_END, 0.0, "", 0.0, False, detail=stops),))
    whole, before, risen = as_one(mission, opened.flights, opened.ways)
    return verify_safe_end(mission, whole, before, risen, stops)


def plans_of(others: tuple[Reverified, ...]) -> list[Judged]:
    """Further plans with their certificates, as arguments of other functions; unreadable ones are omitted."""
    return [(each.opened, each.flown) for each in others if each.opened is not None and each.flown is not None]


def _of_other(name: str, other: Reverified) -> Check:
    """Check that a further plan passes all checks of its folder, with its first failure in words."""
    failures = other.certificate.failures if other.certificate else ()
    say = unjudged if other.undecided else verdict
    return say(name, _plan_failure_text(failures[0]) if failures else "")


def _stated(opened: OutputFolder, flown: Certificate) -> tuple[Check, ...]:
    """Checks that the certificate file in the folder agrees with the computed certificate."""
    plan = hashlib.sha256(opened.files[PLAN]).hexdigest()
    return tuple(check_certificate(opened.text(CERTIFICATE), plan, flown))


def _undecided(certificate: Certificate) -> bool:
    return {check.name for check in certificate.failures} == {UNJUDGED}


def _not_judged(folder: Path, certificate: Certificate) -> Diagnostic:
    return Diagnostic(
        NOT_JUDGED,
        f"a simulation in `{folder}` cannot be repeated here; all other checks pass",
        None,
        notes=tuple(map(_plan_failure_text, certificate.failures)),
        help="repeat the simulation with `missionc simulate`",
    )


def _plan_refused(folder: Path, certificate: Certificate) -> Diagnostic:
    failures = sorted(certificate.failures, key=lambda check: check.name == "manifest")
    more = len(failures) - MOST_REASONS
    return Diagnostic(
        FOLDER_REFUSED,
        f"do not fly `{folder}`: {len(failures)} of {len(certificate.checks)} checks fail",
        None,
        notes=(*map(_plan_failure_text, failures[:MOST_REASONS]), *([f"and {more} more"] if more > 0 else [])),
        help="compile the mission again",
    )


def _plan_failure_text(check: Check) -> str:
    """Description of a failed check: quantity, agents, amount and time."""
    if check.name == "manifest":
        why = check.detail if check.detail == UNLISTED else "its content has changed"
        return f"file `{printable(check.subject)}`: {why}"
    if check.name in (DOCUMENT, UNJUDGED):
        return f"file `{check.subject}`: {check.detail}"
    if check.name == "certificate":
        return f"file `{CERTIFICATE}`: {check.detail}"
    amount = f" by {-check.margin:.3g} {check.unit}" if check.margin < 0 else ""
    when = f" at {check.at:.2f} s" if check.at is not None else ""
    who = f" ({', '.join(check.agents)})" if check.agents and check.agents != (check.subject,) else ""
    return f"{check.name} of {check.subject}{who} fails{amount}{when}: {check.detail}"


def reverify_refusal(folder: Path, limits: Limits | None = None) -> Reverified | None:
    """Verify the proof in a folder; None if it contains none.

    Args:
        folder: path of the folder.
        limits: maximum sizes of the files; the defaults of ``Limits`` if None.
    """
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
    findings = () if certificate.passed else (_proof_refused(found, certificate),)
    proven = _proven(conflict_of(found.files, mission) if of_cover else None) + _given(found)
    return Reverified(folder, findings, certificate=certificate, proven=proven if certificate.passed else "")


def _proven(conflict: tuple[str, ...] | None) -> str:
    if conflict is None:
        return f"the clauses in `{CNF}` are unsatisfiable; how they follow from the mission is not checked"
    names = all_listed([f"`{name}`" for name in conflict])
    if not conflict:
        return "no motion of these agents is feasible, even without the requirements"
    return f"no motion of these agents satisfies {names}{' together' if len(conflict) > 1 else ''}"


def _given(found: FolderFiles) -> str:
    """Parameter values from the command line in words, for a sentence about the mission; empty if there are none."""
    given = [f"{name}={value}" for name, value in options(found.manifest).items() if name.startswith("-D ")]
    return f", with {all_listed([f'`{each}`' for each in given])}" if given else ""


def _proof_refused(found: FolderFiles, certificate: Certificate) -> Diagnostic:
    failures = certificate.failures
    return Diagnostic(
        PROVES_NOTHING,
        f"invalid proof in `{printable(str(found.path))}`: {len(failures)} of {len(certificate.checks)} checks fail",
        None,
        notes=tuple(map(_proof_failure_text, failures[:MOST_REASONS])),
        help="compile the mission again with `--certify`",
    )


def _proof_failure_text(check: Check) -> str:
    if check.name == "manifest":
        why = check.detail if check.detail == UNLISTED else "its content has changed"
        return f"file `{printable(check.subject)}`: {why}"
    return f"{check.name} of {printable(check.subject)}: {check.detail}"
