"""Check of ``simulation.json``: flights repeated with the stated engine and conditions, and compared.

If the engine is not available here, the flights are unknown. Then the check fails with a different result than for a
wrong document.

Rounding, which differs between machines, breaks ties between the worst values of flights: an agent at rest has almost
no error at any time, and a symmetric flight reaches its minimum clearance twice. The document's choice is accepted if
the first flight confirms it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from missionc.base.limits import Limits
from missionc.base.strict_json import NotJsonError, is_finite_number, parse_json, parse_record
from missionc.flight.simulation import engines
from missionc.flight.simulation.disturbance import SETPOINTS_PER_SECOND
from missionc.flight.simulation.engines import EngineError
from missionc.flight.simulation.flight_conditions import conditions, trial_of
from missionc.flight.simulation.judge_flight import room, tracking_error
from missionc.flight.simulation.trial_bounds import QUADROTOR
from missionc.flight.simulation.trials import Trial, Trials, cannot_lose, lost_agents, run
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.ir import Mission
from missionc.output.documents.simulation_json import DIGITS, simulation_json, simulation_record
from missionc.output.folder.file_names import SIMULATION, SIMULATION_SCHEMA, SIMULATIONS_BEFORE
from missionc.tools.replay.read_folder import OutputFolder
from missionc.tools.replay.rebuild.verdict import unjudged, verdict
from missionc.verification.certificate import CERTAIN, Check
from missionc.verification.compare_documents import SAME, close, difference, is_version, shown
from missionc.verification.monitoring.monitor import monitor

Row = dict[str, Any]


def settled(claimed: Row, made: Row, mission: Mission, trials: Trials, same: float) -> Row:
    """Recomputed document, with times and agents from the claimed document where they are equally valid.

    Args:
        claimed: document from the folder, of any shape.
        made: recomputed document.
        mission: mission of the folder.
        trials: repeated flights.
        same: tolerance for equal flights, metres.
    """
    lost = lost_agents(mission, trials.trial.disturbance)
    error = tracking_error(trials.flown.times, trials.planned, trials.flown.position[0], lost)
    tracking = enumerate(_pairs(claimed.get("tracking"), made["tracking"]))
    rooms = _pairs(claimed.get("room"), made["room"])
    return {
        **made,
        "tracking": [_tracking(one, own, error[agent], same) for agent, (one, own) in tracking],
        "room": [_room(one, own, mission, trials, max(same, CERTAIN)) for one, own in rooms],
    }


def _pairs(claimed: object, made: list[Row]) -> list[tuple[Row, Row]]:
    """Claimed and recomputed rows; a claimed one is empty if it is missing or malformed."""
    rows = claimed if isinstance(claimed, list) and len(claimed) == len(made) else [None] * len(made)
    return [(row if isinstance(row, dict) else {}, own) for row, own in zip(rows, made, strict=True)]


def _tracking(claimed: Row, own: Row, error: np.ndarray[Any, np.dtype[np.float64]], same: float) -> Row:
    """Recomputed row of an agent's tracking error, with the claimed time if the agent had the same error then.

    Args:
        claimed, own: claimed and recomputed row.
        error: (samples,), metres.
        same: tolerance, metres.
    """
    when = claimed.get("at")
    if not is_finite_number(when) or not 0 <= when * SETPOINTS_PER_SECOND <= error.size - 1:
        return own
    sample = round(when * SETPOINTS_PER_SECOND)
    there = close(when, sample / SETPOINTS_PER_SECOND) and error[sample] >= own["most"] - same
    return {**own, "at": when} if there else own


def _room(claimed: Row, own: Row, mission: Mission, trials: Trials, same: float) -> Row:
    """Recomputed row of a clearance, with the claimed margin, time and agents if they are equally valid.

    Args:
        claimed, own: claimed and recomputed row.
        mission: mission of the folder.
        trials: repeated flights.
        same: tolerance, metres.
    """
    margin, when, names = claimed.get("margin"), claimed.get("at"), claimed.get("agents")
    if is_finite_number(margin) and abs(margin - own["margin"]) <= same:
        own = {**own, "margin": margin}
    if not is_finite_number(when) or not 0 <= when <= trials.flown.times[-1] or not isinstance(names, list):
        return own
    own_names = [agent.name for agent in mission.agents if agent.name in names]
    if own_names != names or len(names) != len(own["agents"]):
        return own
    near = _margin(own["subject"], names, when, mission, trials) <= own["margin"] + 2 * same
    return {**own, "at": when, "agents": names} if near else own


def _margin(subject: str, names: list[str], when: float, mission: Mission, trials: Trials) -> float:
    """Minimum clearance of agents in the first flight between the two samples around a time, m.

    Args:
        subject: name of an obstacle, or of another kind of clearance.
        names: names of the agents.
        when: time, s.
        mission: mission of the folder.
        trials: repeated flights.
    """
    agents = tuple(agent for agent in mission.agents if agent.name in names)
    obstacles = tuple(obstacle for obstacle in mission.obstacles if obstacle.name == subject)
    times = trials.flown.times
    after = int(np.clip(np.searchsorted(times, when), 1, times.size - 1))
    places = trials.flown.position[0][[agent.index for agent in agents], after - 1 : after + 1]
    part = replace(mission, agents=agents, obstacles=obstacles if len(names) == 1 else ())
    return min(check.margin for check in room(part, times[after - 1 : after + 1], places))


AGREED: Mapping[str, float] = {QUADROTOR: SAME, "rotorpy": 1e-6, "crazyflow": 1e-4}
"""Tolerance between machines for the same flight by engine, in the units of the values."""
PATH = 1.5 * 10**-DIGITS
"""Tolerance of positions in metres, for numbers that are rounded in different directions."""
AGAIN = "`missionc simulate` repeats and replaces it"


def check_simulation(opened: OutputFolder, limits: Limits) -> Check:
    """Check of the simulation: first entry that differs from its flights, or why they cannot be repeated."""
    try:
        document = parse_record(opened.text(SIMULATION), finite=False)
    except NotJsonError as error:
        return verdict(SIMULATION, error.reason)
    if document.get("schema") in SIMULATIONS_BEFORE:
        return unjudged(SIMULATION, f"it has an older format: {AGAIN}")
    if document.get("schema") != SIMULATION_SCHEMA:
        return verdict(SIMULATION, difference(document.get("schema"), SIMULATION_SCHEMA, "schema"))
    trial = trial_of(document)
    if isinstance(trial, str):
        return verdict(SIMULATION, f"invalid `{trial}`: {shown(document.get(trial))}")
    return _told(opened, document, trial, limits)


def _told(opened: OutputFolder, document: dict[str, Any], trial: Trial, limits: Limits) -> Check:
    """Check of the simulation after its conditions are read.

    Args:
        opened: plan folder.
        document: parsed ``simulation.json``.
        trial: conditions of its flights.
        limits: maximum sizes of the flights.
    """
    mission = opened.mission
    seconds = float(mission.horizon)
    wanting = cannot_lose(mission, trial.disturbance)
    if wanting:
        return verdict(SIMULATION, f"invalid `disturbance`: {wanting}")
    if not _are_versions(document.get("versions"), trial.engine):
        return verdict(SIMULATION, "its `versions` do not name the engine and the compiler")
    absent = engines.missing(trial.engine)
    if absent:
        why = f"the engine {trial.engine} is not installed; install it with `pip install 'missionc[{trial.engine}]'`"
        return unjudged(SIMULATION, f"{why}; {AGAIN}")
    own = conditions(trial, seconds)
    other = difference(document["versions"], own["versions"], "versions")
    if other:
        return unjudged(SIMULATION, f"{other}; another version may give other results: {AGAIN}")
    wrong = next(filter(None, (difference(document.get(key), _as_json(own[key]), key, 0.0) for key in own)), None)
    if wrong:
        return verdict(SIMULATION, wrong)
    together = trial.flights * len(mission.agents) * seconds
    if together > limits.simulated_seconds:
        most = f"`--limit simulated_seconds={math.ceil(together)}`"
        why = f"its flights last {together:.6g} s for all agents, more than the limit `simulated_seconds`"
        return unjudged(SIMULATION, f"{why}; raise the limit with {most}")
    try:
        trials = _flown(opened, trial)
    except EngineError as error:
        return unjudged(SIMULATION, f"{trial.engine} cannot run here: {error}; {AGAIN}")
    return verdict(SIMULATION, _differing(document, opened, trials))


def _flown(opened: OutputFolder, trial: Trial) -> Trials:
    polynomials = [read(opened.flights[agent.name]) for agent in opened.mission.agents]
    pieces = [own for own in polynomials if isinstance(own, Pieces)]
    with np.errstate(over="ignore", invalid="ignore"):
        return run(opened.mission, opened.kernel, pieces, trial)


def _differing(document: dict[str, Any], opened: OutputFolder, trials: Trials) -> str | None:
    """First difference between the document and its repeated flights; None if there is none."""
    mission, same = opened.mission, AGREED.get(trials.trial.engine, 1e-6)
    planned = monitor(mission, opened.kernel, opened.trace).requirements
    made = _document(mission, simulation_record(mission, planned, trials), trials)
    claimed = {key: value for key, value in document.items() if key != "flight"}
    path = made.pop("flight")
    return difference(claimed, settled(claimed, made, mission, trials, same), same=same) or difference(
        document.get("flight"), path, "flight", max(same, PATH)
    )


def _document(mission: Mission, entries: Mapping[str, object], trials: Trials) -> dict[str, Any]:
    """Recomputed document after a round trip through JSON."""
    made = parse_json(simulation_json(mission, entries, trials.flown).decode("utf-8"))
    assert isinstance(made, dict)
    return made


def _as_json(value: object) -> object:
    """Value after a round trip through JSON: tuples become lists."""
    if isinstance(value, dict):
        return {key: _as_json(each) for key, each in value.items()}
    return [_as_json(each) for each in value] if isinstance(value, tuple | list) else value


def _are_versions(versions: object, engine: str) -> bool:
    names = {"missionc", engine} - {QUADROTOR}
    return isinstance(versions, dict) and set(versions) == names and all(is_version(each) for each in versions.values())
