"""Simulated flights of a plan folder that a worker flies, from the texts of the folder's files.

in   TrialRequest
out  RunResult: the records of the flights, in a file
"""

from __future__ import annotations

from pathlib import Path

from missionc.flight.simulation.trials import run
from missionc.geometry.curves.piecewise_polynomials import polynomials
from missionc.output.folder.file_names import flights_in
from missionc.tools.replay.read_folder import FolderFiles, check_mission
from missionc.tools.sweep import flights_journal
from missionc.tools.sweep.run_answer import RunResult
from missionc.tools.sweep.trial_request import TrialRequest

FLOWN = "flown"
"""Outcome of a request whose flights were flown."""
RECORDS = "flights.json"


def fly_trials(request: TrialRequest) -> RunResult:
    """Simulate the requested flights.

    Raises:
        ValueError: the files cannot be flown; the requester checks this before.
    """
    checked = check_mission(FolderFiles(Path("folder"), request.manifest, {}, request.files), request.limits)
    mission, kernel = getattr(checked, "mission", None), getattr(checked, "kernel", None)
    if mission is None or kernel is None:
        raise ValueError(f"the mission cannot be read: {checked}")
    texts = flights_in(mission.agents, request.files)
    trials = run(mission, kernel, [polynomials(texts[agent.name]) for agent in mission.agents], request.trial)
    return RunResult(FLOWN, {}, {}, ((RECORDS, flights_journal.flights_text(trials.flights, request.curves)),))
