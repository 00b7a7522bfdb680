"""Request for some of a folder's simulated flights, as JSON text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from missionc.base.limits import Limits
from missionc.base.strict_json import parse_record
from missionc.flight.simulation.disturbance import Disturbance
from missionc.flight.simulation.trials import Trial
from missionc.tools.sweep import run_answer

SCHEMA = "missionc.trials/1"
SECONDS = 3600.0
"""Time limit of a request in seconds, after which its process is killed."""


@dataclass(frozen=True, slots=True)
class TrialRequest:
    """Request for simulated flights of a plan folder.

    Args:
        manifest: contents of the folder's ``manifest.json``.
        files: files that determine flights, by relative name.
        trial: conditions of the flights.
        limits: maximum sizes of the files.
        curves: whether to include the error over time of each flight.
        versions: versions of the packages that may change a flight.
    """

    manifest: Mapping[str, Any]
    files: Mapping[str, bytes]
    trial: Trial
    limits: Limits
    curves: bool
    versions: Mapping[str, str]


def trial_request_text(request: TrialRequest) -> str:
    """Text of a request for flights, on one line."""
    document = {
        "schema": SCHEMA,
        "seconds": SECONDS,
        "engines": [],
        "versions": dict(request.versions),
        "manifest": dict(request.manifest),
        "files": run_answer.sent(request.files),
        "trial": asdict(request.trial),
        "limits": asdict(request.limits),
        "curves": request.curves,
    }
    return run_answer.one_line(document)


def read_trial_request(text: str) -> TrialRequest:
    """Parse the text of ``trial_request_text``.

    Raises:
        ValueError, KeyError, TypeError: the text is not a request.
    """
    document = parse_record(text, SCHEMA)
    drawn = document["trial"].pop("disturbance")
    lost = tuple((str(name), float(when)) for name, when in drawn.pop("lose"))
    trial = Trial(**document["trial"], disturbance=Disturbance(**drawn, lose=lost))
    files = run_answer.received(document["files"])
    limits = Limits(**document["limits"])
    return TrialRequest(document["manifest"], files, trial, limits, document["curves"], document["versions"])
