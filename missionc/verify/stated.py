"""Whether a certificate that somebody wrote states nothing that its files do not come to.

    in   its JSON, and the Certificate that was computed from the files
    out  Checks, each failed one with its reason

Margins may be worse than they are, never better. Every box is looked at: its
bound is computed anew on its stretch of the flight, and the boxes of a check
have to cover all of it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeGuard

from missionc.verify.boxes import Boxes, fault
from missionc.verify.certificate import Certificate, Check, Figure

SCHEMA = "missionc.certificate/2"

SAME = 1e-8
"""Numbers that differ by less, times themselves where they are above 1, are the same: machines differ in rounding."""


def check_stated(text: str, plan_sha256: str, found: Certificate) -> list[Check]:
    """What ``certificate.json`` states, held against what was found."""
    try:
        stated = json.loads(text)
    except (ValueError, RecursionError):
        stated = None
    if not isinstance(stated, dict) or stated.get("schema") != SCHEMA:
        return [_check("schema", "it is no certificate that this version of the compiler writes")]
    head = {"mission": found.mission, "plan_sha256": plan_sha256, "passed": found.passed}
    wrong = next((key for key, value in head.items() if stated.get(key) != value), None)
    return [
        _check("head", wrong and f"its `{wrong}` is not that of the folder"),
        _check("checks", _entries(stated.get("checks"), found.checks)),
        _check("figures", _entries(stated.get("figures"), found.figures)),
        _check("warnings", None if stated.get("warnings") == list(found.warnings) else "its warnings are not all"),
        _check("between_steps", _between(stated.get("between_steps"), found)),
        _check("boxes", _boxes(stated, found)),
    ]


def _check(subject: str, reason: str | None) -> Check:
    return Check("certificate", subject, 0.0, "", 0.0, reason is None, detail=reason or "it states what the files say")


def _entries(stated: object, found: Sequence[Check | Figure]) -> str | None:
    """What is wrong with checks or figures: none left out, none added, no number nicer than it is."""
    if not isinstance(stated, list) or not all(isinstance(entry, dict) for entry in stated):
        return "something is missing in it"
    if [(entry.get("name"), entry.get("subject")) for entry in stated] != [(each.name, each.subject) for each in found]:
        return "it does not have the checks and figures that the folder's files come to"
    reasons = (_entry(entry, each) for entry, each in zip(stated, found, strict=True))
    return next((reason for reason in reasons if reason is not None), None)


def _entry(stated: Mapping[str, Any], found: Check | Figure) -> str | None:
    who = f"{found.name} of {found.subject}"
    for key, value in asdict(found).items():
        if key in ("at", "agents"):
            # Where the margin is equally small at two places, machines may name either.
            continue
        said = stated.get(key)
        if not isinstance(value, float):
            if said != value:
                return f"{who}: its `{key}` is {said!r}, not {value!r}"
        elif not math.isfinite(value):
            if said is not None:
                return f"{who}: its `{key}` is {said!r}, where there is no bound"
        elif not _number(said) or (abs(said - value) > _near(value) and not (key == "margin" and said < value)):
            return f"{who}: its `{key}` is {said!r}, where {value:.9g} is what the files come to"
    return None


def _between(stated: object, found: Certificate) -> str | None:
    """What is wrong with the verdicts between the steps."""
    rows = stated if isinstance(stated, list) else []
    said = [(row.get("requirement"), row.get("verdict")) if isinstance(row, dict) else None for row in rows]
    same = said == [(each.requirement, each.verdict.value) for each in found.between]
    return None if same else "what it states between the steps is not what the files come to"


def _boxes(stated: Mapping[str, object], found: Certificate) -> str | None:
    """What is wrong with the boxes, or with a margin that they do not prove."""
    rows = stated.get("boxes")
    if not isinstance(rows, list) or [_name(row) for row in rows] != [_name_of(boxes) for boxes in found.boxes]:
        return "it does not have boxes for every check along the flight"
    checks = stated["checks"]
    margins = {_name_of_check(entry): entry.get("margin") for entry in checks} if isinstance(checks, list) else {}
    for row, boxes in zip(rows, found.boxes, strict=True):
        name, subject = _name_of(boxes)
        read = _read(row, boxes)
        reason = read if isinstance(read, str) else fault(read)
        if reason is None and isinstance(read, Boxes):
            margin = margins.get((name, subject))
            if not _number(margin) or margin > read.least + 1e-12:
                reason = "its boxes do not prove its margin"
        if reason is not None:
            return f"{name} of {subject}: {reason}"
    return None


def _read(row: Mapping[str, object], boxes: Boxes) -> Boxes | str:
    """The row's boxes, about the claim that the folder's files make."""
    claim = boxes.claim
    times, ends, bounds = (
        list(_rows([row.get("times")])),
        list(_rows(row.get("ends"))),
        list(_rows(row.get("bounds"))),
    )
    if len(times) != 1 or len(times[0]) != claim.times.size:
        return "its times are not those of the flight"
    if any(abs(said - true) > _near(true) for said, true in zip(times[0], claim.times.tolist(), strict=True)):
        return "its times are not those of the flight"
    if row.get("agents") != claim.agents.tolist():
        return "its boxes are not about the agents of the mission"
    if any(not each for each in (*ends, *bounds)):
        return "its boxes do not cover the flight"
    return Boxes(claim, tuple(ends), tuple(bounds))


def _rows(value: object) -> Iterator[tuple[float, ...]]:
    """Lists of finite numbers; an empty one where there is something else."""
    for row in value if isinstance(value, list) else []:
        whole = isinstance(row, list) and all(_number(number) for number in row)
        yield tuple(float(number) for number in row) if whole else ()


def _number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _near(value: float) -> float:
    return SAME * max(1.0, abs(value))


def _name(row: object) -> tuple[object, object] | None:
    return (row.get("check"), row.get("of")) if isinstance(row, dict) else None


def _name_of(boxes: Boxes) -> tuple[str, str]:
    return boxes.claim.name, boxes.claim.subject


def _name_of_check(entry: object) -> tuple[object, object] | None:
    return (entry.get("name"), entry.get("subject")) if isinstance(entry, dict) else None
