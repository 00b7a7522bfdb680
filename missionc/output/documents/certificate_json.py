"""The certificate of a plan as JSON: every check with its margin."""

from __future__ import annotations

import math
from dataclasses import asdict

from missionc.output.json_layout import compact, document, listed
from missionc.verification.certificate import Between, Certificate, Check, Delay, Figure
from missionc.verification.check_certificate import SCHEMA
from missionc.verification.proof.proof_boxes import Boxes


def certificate_json(certificate: Certificate, plan_sha256: str) -> str:
    """Content of ``certificate.json``.

    Args:
        plan_sha256: hash of the ``plan.json`` that it certifies.
    """
    head = {
        "schema": SCHEMA,
        "mission": certificate.mission,
        "plan_sha256": plan_sha256,
        "passed": certificate.passed,
    }
    return document(
        head,
        listed("checks", (compact(_entry(entry)) for entry in certificate.checks)),
        listed("figures", (compact(_entry(entry)) for entry in certificate.figures)),
        listed("between_steps", (compact(_between(each)) for each in certificate.between)),
        listed("delays", (compact(_entry(each)) for each in certificate.delays)),
        listed("boxes", (compact(_boxes(boxes)) for boxes in certificate.boxes)),
        f'  "warnings": {compact(list(certificate.warnings))}',
    )


def _entry(entry: Check | Figure | Delay) -> dict[str, object]:
    return {key: _plain(key, value) for key, value in asdict(entry).items()}


def _between(each: Between) -> dict[str, object]:
    return {key: value.value if key == "verdict" else _plain(key, value) for key, value in asdict(each).items()}


def _boxes(boxes: Boxes) -> dict[str, object]:
    claim = boxes.claim
    return {
        "check": claim.name,
        "of": claim.subject,
        "unit": claim.unit,
        "times": claim.times.tolist(),
        "agents": claim.agents.tolist(),
        "ends": [[_short(end) for end in ends] for ends in boxes.ends],
        "bounds": boxes.bounds,
    }


def _short(number: float) -> float | int:
    return int(number) if number.is_integer() else number


def _plain(key: str, value: object) -> object:
    if isinstance(value, float):
        if not math.isfinite(value):
            return None
        if key == "at":
            return round(value, 6)
        # A proved bound stays a bound: it is rounded towards failing.
        return math.floor(value * 1e12) / 1e12 if key == "margin" and abs(value) < 1e3 else float(value)
    return list(value) if isinstance(value, tuple) else value
