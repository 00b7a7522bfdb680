"""Check of ``alternatives.json``: the further plans of a folder, compared and ranked again.

This module checks that they are plans of the same mission; the verification of each plan is separate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import TypeAlias

from missionc.backends.options import Whole
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.output.documents.alternatives_json import AlternativeRow, alternatives_json, folder_of, rows
from missionc.output.folder.file_names import ALTERNATIVES, MANIFEST, MISSION, MOST_ALTERNATIVES
from missionc.output.with_alternatives import OPTION
from missionc.tools.replay.read_folder import OutputFolder, option
from missionc.tools.replay.rebuild.verdict import verdict
from missionc.verification.certificate import Certificate, Check
from missionc.verification.compare_documents import difference
from missionc.verification.monitoring.signature import Signature, Signatures, differences

Judged: TypeAlias = tuple[OutputFolder, Certificate]
"""Folder of a further plan with the certificate of its flight."""


def table_of(opened: OutputFolder, flown: Certificate, others: Sequence[Judged]) -> list[AlternativeRow]:
    """Table that compares the plans of a folder; empty for one plan, or if one belongs to another mission.

    Args:
        opened: plan folder.
        flown: certificate of its plan.
        others: further plans with their certificates.
    """
    if not _wanted(opened) or _strange(opened, others):
        return []
    signatures = _signatures(opened, others)
    certificates = [flown, *(certificate for _, certificate in others)]
    return rows(signatures, [opened.trace, *(each.trace for each, _ in others)], certificates)


def check_alternatives(opened: OutputFolder, others: Sequence[Judged], table: list[AlternativeRow]) -> Iterator[Check]:
    """Yield the checks that the table is correct, and that each plan is a different one of this mission.

    Args:
        opened: plan folder.
        others: further plans with their certificates.
        table: table computed by ``table_of``.
    """
    wanted = _wanted(opened)
    if not wanted and not others:
        return
    if not table or len(table) > wanted:
        reason = _strange(opened, others) if wanted else "its options do not include alternatives"
        yield verdict(MANIFEST, reason or f"its options request {wanted} plans, but there are more")
        return
    pairs = combinations(_signatures(opened, others), 2)
    if not all(differences(one, other) for one, other in pairs):
        yield verdict(ALTERNATIVES, "two of its plans are equal")
    if ALTERNATIVES not in opened.files:
        yield verdict(ALTERNATIVES, "it is missing")
        return
    try:
        lying = parse_json(opened.text(ALTERNATIVES))
    except NotJsonError as error:
        yield verdict(ALTERNATIVES, error.reason)
        return
    yield verdict(ALTERNATIVES, difference(lying, parse_json(alternatives_json(opened.mission, table))))


def _wanted(opened: OutputFolder) -> int:
    """Number of requested plans from the manifest; 0 if it was one or is malformed."""
    text = option(opened.manifest, OPTION) or ""
    return int(text) if Whole(2, MOST_ALTERNATIVES).admits(text) else 0


def _signatures(opened: OutputFolder, others: Sequence[Judged]) -> list[Signature]:
    signatures = Signatures(opened.mission, opened.kernel)
    return [signatures.of(each.trace) for each in (opened, *(other for other, _ in others))]


def _strange(opened: OutputFolder, others: Sequence[Judged]) -> str:
    """Reason why the further plans do not belong to this mission; empty if they do."""
    names = list(opened.alternatives)
    if names != [folder_of(rank) for rank in range(2, len(names) + 2)]:
        return "the alternatives are not numbered from 2"
    own = _read_with(opened)
    if any(_read_with(each) != own for each, _ in others):
        return "the alternatives are plans of another mission"
    return ""


def _read_with(opened: OutputFolder) -> tuple[object, ...]:
    """Inputs of a folder's mission, for comparison: files, overrides, vehicle and number of steps."""
    texts = {name: content for name, content in opened.files.items() if name.startswith(f"{MISSION}/")}
    return texts, opened.checked.overrides, opened.checked.vehicle, opened.mission.steps
