"""Rebuilt ``simulation.json``: flown once more, by the engine and in the air that it names, and compared.

Where that cannot be done here, nobody knows how the flights went: the check
fails, and is told apart from one of a document that is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from missionc.base.limits import Limits
from missionc.base.strict_json import NotJsonError, parse_json, parse_record
from missionc.curves.crazyflie_csv import Pieces, read
from missionc.ir import Mission
from missionc.monitoring.monitor import monitor
from missionc.output.documents.simulation_json import DIGITS, simulation_json, simulation_record
from missionc.output.folder.file_names import SIMULATION, SIMULATION_SCHEMA, SIMULATIONS_BEFORE
from missionc.replay.read_folder import OutputFolder
from missionc.replay.rebuild.simulation_ties import settled
from missionc.replay.rebuild.verdict import unjudged, verdict
from missionc.simulate import engines
from missionc.simulate.engines import EngineError
from missionc.simulate.flight_conditions import conditions, trial_of
from missionc.simulate.trial_bounds import QUADROTOR
from missionc.simulate.trials import Trial, Trials, cannot_lose, run
from missionc.verify.certificate import Check
from missionc.verify.compare_documents import SAME, difference, is_version, shown

AGREED: Mapping[str, float] = {QUADROTOR: SAME, "rotorpy": 1e-6, "crazyflow": 1e-4}
"""How far the same flight may differ between machines, in the figures' units: rotorpy chooses its steps by what it
sees, and crazyflow counts in float32."""
PATH = 1.5 * 10**-DIGITS
"""Metres: places are kept to so many digits, and two that hardly differ may be rounded apart."""
AGAIN = "`missionc simulate` flies the folder again, and takes its place"


def check_simulation(opened: OutputFolder, limits: Limits) -> Check:
    """The first entry that is not what its flights come to, if there is one; or why they cannot be flown here."""
    try:
        document = parse_record(opened.text(SIMULATION), finite=False)
    except NotJsonError as error:
        return verdict(SIMULATION, error.reason)
    if document.get("schema") in SIMULATIONS_BEFORE:
        return unjudged(SIMULATION, f"it is of an older form, whose flights were flown otherwise: {AGAIN}")
    if document.get("schema") != SIMULATION_SCHEMA:
        return verdict(SIMULATION, difference(document.get("schema"), SIMULATION_SCHEMA, "schema"))
    trial = trial_of(document)
    if isinstance(trial, str):
        return verdict(SIMULATION, f"its `{trial}` is {shown(document.get(trial))}, which cannot be")
    return _told(opened, document, trial, limits)


def _told(opened: OutputFolder, document: dict[str, Any], trial: Trial, limits: Limits) -> Check:
    """The same, of a document that says how to fly."""
    mission = opened.mission
    seconds = float(mission.horizon)
    wanting = cannot_lose(mission, trial.disturbance)
    if wanting:
        return verdict(SIMULATION, f"its `disturbance` cannot be: {wanting}")
    if not _are_versions(document.get("versions"), trial.engine):
        return verdict(SIMULATION, "its `versions` are none of the engine and of the compiler")
    absent = engines.missing(trial.engine)
    if absent:
        why = f"{trial.engine} flew it, which is not installed: `pip install 'missionc[{trial.engine}]'` installs it"
        return unjudged(SIMULATION, f"{why}; {AGAIN}")
    own = conditions(trial, seconds)
    other = difference(document["versions"], own["versions"], "versions")
    if other:
        return unjudged(SIMULATION, f"{other}, and another version may fly otherwise: {AGAIN}")
    wrong = next(filter(None, (difference(document.get(key), _as_json(own[key]), key, 0.0) for key in own)), None)
    if wrong:
        return verdict(SIMULATION, wrong)
    together = trial.flights * len(mission.agents) * seconds
    if together > limits.simulated_seconds:
        most = f"`--limit simulated_seconds={math.ceil(together)}`"
        why = f"its flights take {together:.6g} s of all agents together, more than the limit `simulated_seconds`"
        return unjudged(SIMULATION, f"{why}: allow more with {most}, or fly less of it; {AGAIN}")
    try:
        trials = _flown(opened, trial)
    except EngineError as error:
        return unjudged(SIMULATION, f"{trial.engine} cannot fly here: {error}; {AGAIN}")
    return verdict(SIMULATION, _differing(document, opened, trials))


def _flown(opened: OutputFolder, trial: Trial) -> Trials:
    polynomials = [read(opened.flights[agent.name]) for agent in opened.mission.agents]
    pieces = [own for own in polynomials if isinstance(own, Pieces)]
    with np.errstate(over="ignore", invalid="ignore"):
        return run(opened.mission, opened.kernel, pieces, trial)


def _differing(document: dict[str, Any], opened: OutputFolder, trials: Trials) -> str | None:
    """The first place where the document says something else than its flights come to."""
    mission, same = opened.mission, AGREED[trials.trial.engine]
    planned = monitor(mission, opened.kernel, opened.trace).requirements
    made = _document(mission, simulation_record(mission, planned, trials), trials)
    claimed = {key: value for key, value in document.items() if key != "flight"}
    path = made.pop("flight")
    return difference(claimed, settled(claimed, made, mission, trials, same), same=same) or difference(
        document.get("flight"), path, "flight", max(same, PATH)
    )


def _document(mission: Mission, entries: Mapping[str, object], trials: Trials) -> dict[str, Any]:
    """A document as it is read back."""
    made = parse_json(simulation_json(mission, entries, trials.flown).decode("utf-8"))
    assert isinstance(made, dict)
    return made


def _as_json(value: object) -> object:
    """A value as it is read back: what is a tuple is a list then."""
    if isinstance(value, dict):
        return {key: _as_json(each) for key, each in value.items()}
    return [_as_json(each) for each in value] if isinstance(value, tuple | list) else value


def _are_versions(versions: object, engine: str) -> bool:
    names = {"missionc", engine} - {QUADROTOR}
    return isinstance(versions, dict) and set(versions) == names and all(is_version(each) for each in versions.values())
