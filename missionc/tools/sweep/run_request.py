"""Request for one run of a sweep, as JSON text for any process or machine.

It contains only data: the mission's files, texts, numbers and names, and no Python objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from missionc.backends.options import DESCRIBED, Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.limits import Limits
from missionc.base.strict_json import parse_record
from missionc.base.units import Seconds
from missionc.tools.sweep import run_answer

SCHEMA = "missionc.run/1"
TIME_LIMIT = Seconds(600.0)
"""Default time limit of a run, seconds."""


@dataclass(frozen=True, slots=True)
class Flights:
    """Simulated flights of a plan.

    Args:
        trials: number of flights.
        disturbance: amounts of disturbances, by the fields of ``simulate.disturbance``.
        lost: agents whose motors stop, with the time, s.
    """

    trials: int
    disturbance: Mapping[str, float] = field(default_factory=dict)
    lost: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings that all runs of a sweep share.

    Args:
        files: the mission's files, by relative name, the mission first.
        fixed: parameters with one value in all runs.
        limits, backend, vehicle, options: as in ``compile``.
        time_limit: time limit of planning a run.
        memory_limit: maximum memory of a run, bytes.
        flights: simulated flights of each plan, or None.
        keep: whether to return the files of each plan.
        versions: versions of the packages that may change a plan: a worker with others refuses the run.
    """

    files: Mapping[str, bytes]
    fixed: Mapping[str, str] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)
    backend: str = "auto"
    vehicle: str = ""
    options: Options = field(default_factory=Options)
    time_limit: Seconds = TIME_LIMIT
    memory_limit: int = 8 << 30
    throughout: ContinuousTime = ContinuousTime.WANTED
    flights: Flights | None = None
    keep: bool = False
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def shared(self) -> dict[str, object]:
        """JSON record of all settings that change results, except the files; equal for all runs of a sweep."""
        return {
            "fixed": dict(self.fixed),
            "limits": asdict(self.limits),
            "backend": self.backend,
            "vehicle": self.vehicle,
            "options": {name: getattr(self.options, name) for name in DESCRIBED},
            "time_limit": self.time_limit,
            "memory_limit": self.memory_limit,
            "throughout": self.throughout.value,
            "flights": asdict(self.flights) if self.flights else None,
            "versions": dict(self.versions),
        }


@dataclass(frozen=True, slots=True)
class Request:
    """Request for one run.

    Args:
        settings: settings shared by the runs of the sweep.
        values: parameter values as texts.
        seed: random seed.
        engines: engines that may plan it, which a process preloads; empty for all.
    """

    settings: Settings
    values: Mapping[str, str]
    seed: int
    engines: tuple[str, ...] = ()


def run_request_text(request: Request) -> str:
    """Text of a run's request, on one line."""
    settings = request.settings
    document = {
        "schema": SCHEMA,
        "seconds": settings.time_limit * (2 if settings.flights else 1),
        "files": run_answer.sent(settings.files),
        "values": dict(request.values),
        "seed": request.seed,
        "engines": list(request.engines),
        "keep": settings.keep,
        **settings.shared,
    }
    return run_answer.one_line(document)


def read_run_request(text: str) -> Request:
    """Parse the text of ``run_request_text``.

    Raises:
        ValueError, KeyError, TypeError: the text is not a request.
    """
    document = parse_record(text, SCHEMA)
    settings = Settings(
        run_answer.received(document["files"]),
        document["fixed"],
        Limits(**document["limits"]),
        document["backend"],
        document["vehicle"],
        Options(**document["options"]),
        Seconds(document["time_limit"]),
        document["memory_limit"],
        ContinuousTime(document["throughout"]),
        _flights(document["flights"]),
        document["keep"],
        document["versions"],
    )
    return Request(settings, document["values"], document["seed"], tuple(document["engines"]))


def _flights(document: Mapping[str, Any] | None) -> Flights | None:
    if document is None:
        return None
    lost = tuple((str(name), float(when)) for name, when in document["lost"])
    return Flights(document["trials"], document["disturbance"], lost)
