"""Trials that are spread over an executor: the first flights are flown here, the others wherever there is time.

    in   a Pool, the folder, how to fly
    out  Trials: those of one process, number by number

Everything that is drawn for a flight follows from the seed and its number, so
that it is the same whoever flies it, and with whichever others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace

from missionc.base.limits import Limits
from missionc.curves.crazyflie_csv import Pieces
from missionc.diagnostics.model import Diagnostic
from missionc.output.folder.file_names import MISSION, PAST
from missionc.replay.read_folder import OutputFolder
from missionc.replay.simulate_folder import fly_here
from missionc.simulate.judge_flight import Flight
from missionc.simulate.trial_bounds import QUADROTOR
from missionc.simulate.trials import Trial, Trials
from missionc.sweep import executors, flight_records, run_answer, trial_request
from missionc.sweep.carry_out_trials import FLOWN, RECORDS
from missionc.sweep.executors import Pool
from missionc.sweep.run_sweep import received
from missionc.sweep.trial_request import TrialRequest

MOST_TOGETHER = 1000
"""Flights of one request: each costs a worker as much time as a hundred flights, however few are in it."""


class NotFlown(Exception):
    """A worker did not fly what it was given; ``finding`` says why."""

    def __init__(self, finding: Diagnostic) -> None:
        super().__init__(finding.message)
        self.finding = finding


@dataclass(frozen=True, slots=True)
class SpreadTrials:
    """What ``simulate_folder.simulate`` flies with, on the workers of a pool.

    Args:
        curves: whether the error over time of each flight is wanted, for a picture.
    """

    pool: Pool
    limits: Limits
    curves: bool = False

    def __call__(
        self, opened: OutputFolder, pieces: list[Pieces], trial: Trial, listen: Callable[[int], None]
    ) -> Trials:
        """Fly.

        Raises:
            NotFlown: a worker cannot.
        """
        here = trial.kept
        if trial.engine != QUADROTOR or not trial.disturbance.random or trial.flights <= here:
            return fly_here(opened, pieces, trial, listen)
        asked = self._asked(opened, replace(trial, flights=trial.flights - here, first=here, kept=1))
        first = fly_here(opened, pieces, replace(trial, flights=here), listen)
        return replace(first, trial=trial, flights=(*first.flights, *self._heard(opened, asked, first, listen)))

    def _asked(self, opened: OutputFolder, trial: Trial) -> dict[Future[str], Trial]:
        """The requests, as many for every worker, with the flights of each."""
        rounds = -(-trial.flights // (MOST_TOGETHER * max(1, self.pool.workers())))
        size = -(-trial.flights // (rounds * max(1, self.pool.workers())))
        last = trial.first + trial.flights
        parts = [
            replace(trial, first=begin, flights=min(size, last - begin)) for begin in range(trial.first, last, size)
        ]
        return {self.pool.submit(self._request(opened, part)): part for part in parts}

    def _heard(
        self, opened: OutputFolder, asked: dict[Future[str], Trial], shown: Trials, listen: Callable[[int], None]
    ) -> list[Flight]:
        """The flights of all answers, in the order of their numbers."""
        found: dict[int, list[Flight]] = {}
        again: Counter[int] = Counter()
        left = set(asked)
        while left:
            over, left = wait(left, return_when=FIRST_COMPLETED)
            for future in over:
                part = asked[future]
                if executors.abandoned(future) and again[part.first] < executors.AGAIN:
                    again[part.first] += 1
                    once_more = self.pool.submit(self._request(opened, part))
                    asked[once_more] = part
                    left.add(once_more)
                else:
                    found[part.first] = self._flights(future, shown)
            listen(len(shown.flights) + sum(map(len, found.values())))
        return [flight for begin in sorted(found) for flight in found[begin]]

    def _flights(self, future: Future[str], shown: Trials) -> list[Flight]:
        answer = received(future, run_answer.versions_here())
        if isinstance(answer, Diagnostic):
            raise NotFlown(answer)
        if answer.result.outcome != FLOWN:
            raise NotFlown(executors.not_done(str(answer.result.values.get("says"))))
        return flight_records.read(dict(answer.result.files)[RECORDS], shown.flights[0].trace)

    def _request(self, opened: OutputFolder, trial: Trial) -> str:
        needed = {name: content for name, content in opened.files.items() if _needed(name)}
        manifest = {name: opened.manifest[name] for name in ("inputs", "options", "files") if name in opened.manifest}
        request = TrialRequest(manifest, needed, trial, self.limits, self.curves, run_answer.versions_here())
        return trial_request.written(request)


def _needed(name: str) -> bool:
    """Whether a flight follows from this file of the folder."""
    return name.startswith((f"{MISSION}/", "crazyflie/")) or name == PAST
