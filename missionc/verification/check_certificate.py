"""Comparison of a stored certificate with the one computed from the files of its plan folder.

    in   its JSON, and the Certificate computed from the files
    out  Checks, each failed one with its reason

The comparison covers every entry, and rejects missing and additional ones. A proved margin may be worse than the
computed one by the gap of a proof, but never better. The bound of every box is recomputed on its part of the flight,
and the boxes of a check must cover the complete flight.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeAlias

from missionc.base.strict_json import NotJsonError, is_finite_number, parse_record
from missionc.verification.certificate import CERTAIN, Certificate, Check, Figure
from missionc.verification.compare_documents import close, difference, shown
from missionc.verification.proof.branch_and_bound import SHARE
from missionc.verification.proof.proof_boxes import Boxes, fault

SCHEMA = "missionc.certificate/2"

KEYS = (
    "schema",
    "mission",
    "plan_sha256",
    "passed",
    "checks",
    "figures",
    "between_steps",
    "delays",
    "boxes",
    "warnings",
)
"""Keys of ``certificate.json``, in their order."""

Anywhere: TypeAlias = tuple[set[str], float]
"""Bounds for the report of a smallest margin: the names of all agents, and the last time of the flight in seconds."""

MOMENT = 2e-6
"""Tolerance of the time ``at`` of the smallest margin, seconds; the file has it to a millionth."""


def check_certificate(text: str, plan_sha256: str, certificate: Certificate) -> list[Check]:
    """Checks that compare the entries of ``certificate.json`` with the computed certificate.

    Args:
        text: content of ``certificate.json``.
        plan_sha256: hash of the plan file that the certificate must state.
    """
    try:
        stated = parse_record(text, SCHEMA)
    except NotJsonError:
        return [_check("schema", "not a certificate of this version of the compiler")]
    return [
        _check("head", _head(stated, plan_sha256, certificate)),
        _check("checks", _entries(stated.get("checks"), certificate.checks, certificate)),
        _check("figures", _entries(stated.get("figures"), certificate.figures, certificate)),
        _check(
            "warnings", None if stated.get("warnings") == list(certificate.warnings) else "its warnings are incomplete"
        ),
        _check("between_steps", _between(stated.get("between_steps"), certificate)),
        _check("delays", _delays(stated.get("delays"), certificate)),
        _check("boxes", _boxes(stated, certificate)),
    ]


def _check(subject: str, reason: str | None) -> Check:
    return Check("certificate", subject, 0.0, "", 0.0, reason is None, detail=reason or "its contents match the files")


def _head(stated: Mapping[str, object], plan_sha256: str, certificate: Certificate) -> str | None:
    head = {"mission": certificate.mission, "plan_sha256": plan_sha256, "passed": certificate.passed}
    wrong = next((key for key, value in head.items() if difference(stated.get(key), value)), None)
    if wrong is not None:
        return f"its `{wrong}` does not match the folder"
    strange = next((key for key in stated if key not in KEYS), None)
    return None if strange is None else f"unexpected entry {shown(strange)}"


def _entries(stated: object, computed: Sequence[Check | Figure], whole: Certificate) -> str | None:
    """Describe the first error in the stored checks or quantities: missing, additional, or better than computed.

    None if there is no error.
    """
    if not isinstance(stated, list) or not all(isinstance(entry, dict) for entry in stated):
        return "an entry is missing"
    if [(entry.get("name"), entry.get("subject")) for entry in stated] != [
        (each.name, each.subject) for each in computed
    ]:
        return "its checks and figures do not match the files"
    proved = {_name_of(boxes) for boxes in whole.boxes}
    somewhere = _anywhere(whole)
    reasons = (
        _entry(entry, each, (each.name, each.subject) in proved, somewhere)
        for entry, each in zip(stated, computed, strict=True)
    )
    return next((reason for reason in reasons if reason is not None), None)


def _anywhere(whole: Certificate) -> Anywhere:
    """All agents that a check of the certificate is about, and the last time of the flight in seconds."""
    ends = [float(boxes.claim.times[-1]) for boxes in whole.boxes]
    return {agent for check in whole.checks for agent in check.agents}, max(ends, default=0.0)


def _entry(stated: Mapping[str, Any], entry: Check | Figure, proved: bool, anywhere: Anywhere) -> str | None:
    who = f"{entry.name} of {entry.subject}"
    computed = _plain(asdict(entry))
    if set(stated) != set(computed):
        return f"{who}: its keys do not match"
    # What is met to rounding is tightest where rounding is worst: machines may name any time, and anybody.
    exact = isinstance(entry, Figure) or abs(entry.margin) > entry.tolerance
    for key, value in computed.items():
        stated_value = stated[key]
        if key == "at" and not (
            _moment(stated_value, value)
            or (not exact and is_finite_number(stated_value) and 0 <= stated_value <= anywhere[1])
        ):
            return f"{who}: its `at` is {shown(stated_value)}, but the files give {shown(value)}"
        if key == "at" or (key == "agents" and not exact and _names(stated_value, value, anywhere[0])):
            continue
        worse = CERTAIN + SHARE * abs(value) if key == "margin" and proved and is_finite_number(value) else 0.0
        if is_finite_number(stated_value) and is_finite_number(value) and value - worse <= stated_value <= value:
            continue
        wrong = difference(stated_value, value, key)
        if wrong is not None:
            return f"{who}: {wrong}"
    return None


def _plain(entry: dict[str, Any]) -> dict[str, Any]:
    """The entry as JSON values: infinities and NaN become null, and tuples lists."""
    return {
        key: list(value)
        if isinstance(value, tuple)
        else None
        if isinstance(value, float) and not math.isfinite(value)
        else value
        for key, value in entry.items()
    }


def _moment(stated: object, value: float | None) -> bool:
    if value is None or not is_finite_number(stated):
        return stated is value
    return abs(stated - value) <= MOMENT + 1e-12 * abs(value)


def _names(stated: object, value: list[str], agents: set[str]) -> bool:
    return isinstance(stated, list) and len(stated) == len(value) and all(name in agents for name in map(str, stated))


def _between(stated: object, certificate: Certificate) -> str | None:
    """Describe the first error in the stored continuous-time verdicts; None if there is none."""
    computed = [_plain({**asdict(each), "verdict": each.verdict.value}) for each in certificate.between]
    return None if _same_rows(stated, computed) else "its verdicts between samples do not match the files"


def _delays(stated: object, certificate: Certificate) -> str | None:
    """Describe the first error in the stored delay tolerances; None if there is none."""
    computed = [_plain(asdict(each)) for each in certificate.delays]
    return None if _same_rows(stated, computed) else "its delay tolerances do not match the files"


def _same_rows(stated: object, computed: list[dict[str, Any]]) -> bool:
    """Return whether the stored rows equal the computed ones, up to rounding of the time ``at``."""
    rows = stated if isinstance(stated, list) else []
    return len(rows) == len(computed) and all(
        isinstance(row, dict)
        and set(row) == set(each)
        and _moment(row["at"], each["at"])
        and difference({**row, "at": None}, {**each, "at": None}) is None
        for row, each in zip(rows, computed, strict=True)
    )


def _boxes(stated: Mapping[str, object], certificate: Certificate) -> str | None:
    """Describe the first error in the stored proof boxes, or a margin that they do not prove; None if there is none."""
    rows = stated.get("boxes")
    if not isinstance(rows, list) or [_name(row) for row in rows] != [_name_of(boxes) for boxes in certificate.boxes]:
        return "boxes are missing for a check along the flight"
    checks = stated.get("checks")
    entries = [entry for entry in checks if isinstance(entry, dict)] if isinstance(checks, list) else []
    margins = {(str(entry.get("name")), str(entry.get("subject"))): entry.get("margin") for entry in entries}
    for row, boxes in zip(rows, certificate.boxes, strict=True):
        name, subject = _name_of(boxes)
        read = _read(row, boxes)
        reason = read if isinstance(read, str) else fault(read)
        if reason is None and isinstance(read, Boxes):
            margin = margins.get((name, subject))
            if not is_finite_number(margin) or margin > read.least + 1e-12:
                reason = "its boxes do not prove its margin"
        if reason is not None:
            return f"{name} of {subject}: {reason}"
    return None


def _read(row: Mapping[str, object], boxes: Boxes) -> Boxes | str:
    """The proof boxes of a stored row, for the claim about the folder's files, or a text that describes its first
    error.
    """
    claim = boxes.claim
    if set(row) != {"check", "of", "unit", "times", "agents", "ends", "bounds"} or row.get("unit") != claim.unit:
        return "its keys do not match"
    times, ends, bounds = (
        list(_rows([row.get("times")])),
        list(_rows(row.get("ends"))),
        list(_rows(row.get("bounds"))),
    )
    if len(times) != 1 or len(times[0]) != claim.times.size:
        return "its times do not match the flight"
    if any(not close(time, true) for time, true in zip(times[0], claim.times.tolist(), strict=True)):
        return "its times do not match the flight"
    if difference(row.get("agents"), claim.agents.tolist()) is not None:
        return "its boxes do not match the agents of the mission"
    if any(not each for each in (*ends, *bounds)):
        return "its boxes do not cover the flight"
    return Boxes(claim, tuple(ends), tuple(bounds))


def _rows(value: object) -> Iterator[tuple[float, ...]]:
    """Yield each row of a JSON list as a tuple of finite numbers, or an empty tuple if it is anything else."""
    for row in value if isinstance(value, list) else []:
        whole = isinstance(row, list) and all(is_finite_number(number) for number in row)
        yield tuple(float(number) for number in row) if whole else ()


def _name(row: object) -> tuple[object, object] | None:
    return (row.get("check"), row.get("of")) if isinstance(row, dict) else None


def _name_of(boxes: Boxes) -> tuple[str, str]:
    return boxes.claim.name, boxes.claim.subject
