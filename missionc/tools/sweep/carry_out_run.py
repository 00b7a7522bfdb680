"""Run of a sweep: compilation of a mission within limits, its flights if requested, and the result.

in   Request
out  RunResult

The mission's files are first written to a folder of their own, which becomes this process's working directory.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from missionc.backends.api import Impossible, NotFound
from missionc.base.deadline import last_call
from missionc.base.diagnostics.model import has_errors
from missionc.base.memory import limited
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.compiler.run_limited import Ended, within
from missionc.frontend.syntax.read_file import LINK
from missionc.output.documents.alternatives_json import least_margin
from missionc.output.folder.file_names import flights_in
from missionc.output.folder.manifest import sha256
from missionc.tools.sweep.run_answer import ERROR, RunResult, Value
from missionc.tools.sweep.run_request import Flights, Request

if TYPE_CHECKING:
    from missionc.flight.simulation.trials import Trials

SAID = 300
"""Maximum length of a message in a table, characters."""
DIGITS = 9
"""Number of decimals in a table."""


def carry_out(request: Request) -> RunResult:
    """Compile the mission of a request, and simulate the flights of the plan if requested."""
    settings = request.settings
    with TemporaryDirectory(prefix="missionc-run-", ignore_cleanup_errors=True) as folder:
        put_files(Path(folder), settings.files)
        os.chdir(folder)
        try:
            began = time.monotonic()
            compiled = driver.compile(
                Path(next(iter(settings.files))),
                overrides={**settings.fixed, **request.values},
                backend=settings.backend,
                seed=request.seed,
                time_limit=settings.time_limit,
                memory_limit=settings.memory_limit,
                options=settings.options,
                limits=settings.limits,
                continuous_time=settings.throughout,
                vehicle=settings.vehicle,
            )
            seconds = time.monotonic() - began
            values = {"seconds": round(seconds, 4), **_of_compilation(compiled)}
            if settings.flights and isinstance(compiled.outcome, Verified):
                values |= _flown(compiled, compiled.outcome, settings.flights, request)
        finally:
            os.chdir("/")
    keep = tuple(compiled.files.items()) if settings.keep and isinstance(compiled.outcome, Verified) else ()
    return RunResult(compiled.word or ERROR, values, _sizes(compiled), keep)


def put_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a mission's files to a folder; a link between them stays a link."""
    for name, content in files.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        link = LINK.fullmatch(content.decode("utf-8", "replace")) if content.startswith(b"include ") else None
        if link and not name.endswith(".mission"):
            place.symlink_to(link[1])
        else:
            place.write_bytes(content)


def _of_compilation(compiled: Compiled) -> dict[str, Value]:
    """Table columns of a compilation: sizes, codes and messages."""
    mission, outcome = compiled.checked.mission, compiled.outcome
    errors = [finding for finding in compiled.findings if has_errors([finding])]
    says = errors or list(compiled.findings)
    values: dict[str, Value] = {
        "agents": len(mission.agents) if mission else None,
        "steps": mission.steps if mission else None,
        "codes": " ".join(dict.fromkeys(finding.code.name for finding in says)) or None,
        "says": says[0].message[:SAID] if says else None,
    }
    if not isinstance(outcome, InvalidMission):
        values["engine"] = outcome.report.engine or (compiled.checked.choice.backend if compiled.checked.choice else "")
        values["cut_short"] = outcome.report.cut_short.value if outcome.report.cut_short else None
    if isinstance(outcome, Impossible):
        values["scope"] = outcome.scope.value
    if isinstance(outcome, NotFound):
        values["cut_short"] = outcome.reason.value
    if isinstance(outcome, Verified):
        trace, judgements = outcome.plan.trace, outcome.plan.judgements
        least = min(judgements, key=lambda each: each.robustness, default=None)
        values |= {
            "engine": outcome.plan.backend,
            "length": round(trace.metres, DIGITS),
            "duration": round(trace.lasts * float(trace.step), DIGITS),
            "robustness": _finite(least.robustness) if least else None,
            "tightest": least.name if least else None,
            "margin": _finite(least_margin(outcome.certificate)),
            "plan": sha256(dict(outcome.files)["plan.json"]),
        }
    return values


def _sizes(compiled: Compiled) -> dict[str, int]:
    return {} if isinstance(compiled.outcome, InvalidMission) else dict(compiled.outcome.report.sizes)


def _finite(value: float) -> float | None:
    return round(value, DIGITS) if math.isfinite(value) else None


def _flown(compiled: Compiled, outcome: Verified, flights: Flights, request: Request) -> dict[str, Value]:
    """Table columns of the simulated flights; empty after a timeout.

    Args:
        compiled: compilation with a plan.
        outcome: verified plan.
        flights: number and conditions of the flights.
        request: request of the run.
    """
    deadline = time.monotonic() + request.settings.time_limit
    began = time.monotonic()
    with limited(request.settings.memory_limit):
        trials = within(last_call(deadline), partial(_fly, compiled, outcome, flights, request.seed))
    values: dict[str, Value] = {"flown_in": round(Seconds(time.monotonic() - began), 4)}
    if isinstance(trials, Ended):
        return {**values, "says": trials.during("simulating flights")[:SAID]}
    mission = compiled.checked.valid_mission
    return {
        **values,
        "flights": len(trials.flights),
        "flights_kept": trials.kept.held,
        "tracking_error": _finite(max(trials.error(agent.index).most for agent in mission.agents)),
    }


def _fly(compiled: Compiled, outcome: Verified, flights: Flights, seed: int) -> Trials:
    from missionc.flight.simulation.disturbance import Disturbance
    from missionc.flight.simulation.trials import Trial, run
    from missionc.geometry.curves.piecewise_polynomials import Pieces, read

    mission, kernel = compiled.checked.valid_mission, compiled.checked.valid_kernel
    texts = flights_in(mission.agents, dict(outcome.files))
    pieces = [read(texts[agent.name]) for agent in mission.agents]
    given = dict(flights.disturbance)
    lost = tuple((str(name), float(when)) for name, when in flights.lost)
    trial = Trial(flights=flights.trials, disturbance=Disturbance(**given, lose=lost), seed=seed)
    return run(mission, kernel, [each for each in pieces if isinstance(each, Pieces)], trial)
