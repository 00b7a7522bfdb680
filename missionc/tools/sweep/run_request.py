"""The request for one run, as it goes over the wire: a text in JSON, whichever process or machine carries it out.

No object of ours goes there, and nothing that could be more than data: the
mission's files, texts, numbers and names.
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
"""The limit of a run, where nobody says otherwise."""


@dataclass(frozen=True, slots=True)
class Flights:
    """How a plan is flown.

    Args:
        trials: so many flights.
        disturbance: what they meet, by the fields of ``simulate.disturbance``.
        lost: whose motors stop, and when, s.
    """

    trials: int
    disturbance: Mapping[str, float] = field(default_factory=dict)
    lost: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything that all runs of a sweep have in common.

    Args:
        files: the mission's files, by their names relative to its folder, the mission first.
        fixed: parameters that have one value in all runs.
        flights: how each plan is flown; None for not at all.
        keep: whether the files of each plan come back.
        versions: of the packages that may change a plan: a worker with others refuses the run.
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
        """For JSON: what changes results, but for the files; the same for every run."""
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
    """One run: what it shares with the others, the values of its parameters, and its seed.

    Args:
        engines: that may plan it, so that a process can be made ready for them; empty for all.
    """

    settings: Settings
    values: Mapping[str, str]
    seed: int
    engines: tuple[str, ...] = ()


def run_request_text(request: Request) -> str:
    """The text of a request, on one line."""
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
    """The request in a text of ``written``.

    Raises:
        ValueError, KeyError, TypeError: the text is none.
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
