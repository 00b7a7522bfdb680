"""Simulated flights distributed over workers; the first ones, which are displayed, are flown here.

    in   a Pool, the folder, the flight conditions
    out  Trials, identical to those of one process

All random values of a flight follow from the seed and its number, so that it does not depend on the worker or on other
flights. Flights in a journal are therefore not repeated.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Container, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict, dataclass, replace
from typing import Any

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.extension import Pieces
from missionc.flight.simulation.judge_flight import Flight
from missionc.flight.simulation.trial_bounds import QUADROTOR
from missionc.flight.simulation.trials import Trial, Trials
from missionc.output.folder.file_names import MISSION, PAST
from missionc.output.folder.manifest import sha256
from missionc.tools.replay.read_folder import OutputFolder
from missionc.tools.replay.simulate_folder import fly_here
from missionc.tools.sweep import flights_journal, run_answer, run_sweep, trial_request
from missionc.tools.sweep.carry_out_trials import FLOWN, RECORDS
from missionc.tools.sweep.flights_journal import FlightsJournal
from missionc.tools.sweep.run_sweep import Pool, received_answers
from missionc.tools.sweep.trial_request import TrialRequest

MOST_TOGETHER = 1000
"""Maximum number of flights in one request; a request costs a worker the time of about a hundred flights."""


MOST_LOST = 400
"""Maximum number of flights in one request with a journal; they are lost if the process is killed."""


class NotFlown(Exception):
    """Error: a worker did not fly its flights, for the reason in ``finding``."""

    def __init__(self, finding: Diagnostic) -> None:
        super().__init__(finding.message)
        self.finding = finding


@dataclass(frozen=True, slots=True)
class SpreadTrials:
    """Function that flies trials on the workers of a pool, for ``simulate_folder.simulate``.

    Args:
        pool: workers.
        limits: maximum sizes of the files.
        curves: whether to include the error over time of each flight, for a picture.
        journal: journal of finished flights, which is extended.
    """

    pool: Pool
    limits: Limits
    curves: bool = False
    journal: FlightsJournal | None = None

    def __call__(
        self, opened: OutputFolder, pieces: list[Pieces], trial: Trial, listen: Callable[[int], None]
    ) -> Trials:
        """Simulate the flights of a folder.

        Args:
            opened: plan folder.
            pieces: polynomials of each agent.
            trial: conditions of the flights.
            listen: called with the number of finished flights.

        Raises:
            NotFlown: a worker fails, or the journal belongs to other flights.
        """
        here = trial.kept
        if trial.engine != QUADROTOR or not trial.disturbance.random or trial.flights <= here:
            return fly_here(opened, pieces, trial, listen)
        rest = range(here, trial.flights)
        if self.journal is None:
            asked = self._asked(opened, trial, [rest])
            first = fly_here(opened, pieces, replace(trial, flights=here), listen)
            flights = {}
        else:
            first = fly_here(opened, pieces, replace(trial, flights=here), listen)
            wrong = self.journal.begin(self._identity(opened, trial), first.flights[0])
            if wrong:
                raise NotFlown(wrong)
            flights = {number: self.journal.over[number] for number in rest if number in self.journal.over}
            asked = self._asked(opened, trial, _gaps(rest, flights))
        self._hear(opened, asked, first, flights, listen)
        return replace(first, trial=trial, flights=(*first.flights, *(flights[number] for number in rest)))

    def _asked(self, opened: OutputFolder, trial: Trial, gaps: Sequence[range]) -> dict[Future[str], Trial]:
        """Submit requests for missing flights, equally many for every worker; return the flights of each request.

        Args:
            opened: plan folder.
            trial: conditions of all flights.
            gaps: ranges of missing flight numbers.
        """
        together = min(MOST_LOST, MOST_TOGETHER) if self.journal else MOST_TOGETHER
        workers = max(1, self.pool.workers())
        count = sum(map(len, gaps))
        rounds = math.ceil(count / (together * workers))
        size = math.ceil(count / max(1, rounds * workers)) or 1
        parts = [
            replace(trial, first=begin, flights=min(size, gap.stop - begin), kept=1)
            for gap in gaps
            for begin in range(gap.start, gap.stop, size)
        ]
        return {self.pool.submit(self._request(opened, part)): part for part in parts}

    def _hear(
        self,
        opened: OutputFolder,
        asked: dict[Future[str], Trial],
        shown: Trials,
        found: dict[int, Flight],
        listen: Callable[[int], None],
    ) -> None:
        """Collect the flights of all requests by number.

        Args:
            opened: plan folder.
            asked: submitted requests with their flights.
            shown: flights that were flown here.
            found: finished flights by number, which is extended.
            listen: called with the number of finished flights.

        Raises:
            NotFlown: a worker fails, or writing the journal does.
        """
        again: Counter[int] = Counter()
        failed: NotFlown | None = None
        left = set(asked)
        while left and not failed:
            over, left = wait(left, return_when=FIRST_COMPLETED)
            for future in over:
                part = asked[future]
                if run_sweep.abandoned(future) and again[part.first] < run_sweep.AGAIN:
                    again[part.first] += 1
                    once_more = self.pool.submit(self._request(opened, part))
                    asked[once_more] = part
                    left.add(once_more)
                    continue
                try:
                    found |= enumerate(self._flights(future, part, shown), part.first)
                except NotFlown as error:
                    failed = error  # finished ones are kept
            listen(len(shown.flights) + len(found))
        if failed:
            raise failed

    def _flights(self, future: Future[str], part: Trial, shown: Trials) -> list[Flight]:
        answer = received_answers(future, run_answer.versions_here())
        if isinstance(answer, Diagnostic):
            raise NotFlown(answer)
        if answer.result.outcome != FLOWN:
            raise NotFlown(run_sweep.not_done(str(answer.result.values.get("says"))))
        records = dict(answer.result.files)[RECORDS]
        flights = flights_journal.parse_flights(records, shown.flights[0].trace)
        wrong = self.journal.add(part.first, records, flights) if self.journal else None
        if wrong:
            raise NotFlown(wrong)
        return flights

    def _identity(self, opened: OutputFolder, trial: Trial) -> dict[str, str]:
        """Settings that determine a flight apart from its number, for the journal's first line."""
        about = json.dumps([opened.manifest.get("inputs"), opened.manifest.get("options")], sort_keys=True)
        files = "".join(f"{name} {sha256(content)}\n" for name, content in sorted(self._files(opened).items()))
        drawn = {name: str(value) for name, value in asdict(trial.disturbance).items()}
        versions = {f"version of {name}": number for name, number in run_answer.versions_here().items()}
        picture = "to be drawn" if self.curves else "not asked for"
        folder = sha256(f"{about}\n{files}".encode())
        return {"folder": folder, "seed": str(trial.seed), **drawn, "picture": picture, **versions}

    def _files(self, opened: OutputFolder) -> dict[str, bytes]:
        return {name: content for name, content in opened.files.items() if _needed(name)}

    def _manifest(self, opened: OutputFolder) -> dict[str, Any]:
        return {name: opened.manifest[name] for name in ("inputs", "options", "files") if name in opened.manifest}

    def _request(self, opened: OutputFolder, trial: Trial) -> str:
        versions = run_answer.versions_here()
        request = TrialRequest(self._manifest(opened), self._files(opened), trial, self.limits, self.curves, versions)
        return trial_request.trial_request_text(request)


def _gaps(numbers: range, there: Container[int]) -> list[range]:
    """Ranges of consecutive numbers that are missing."""
    missing = [number for number in numbers if number not in there]
    begins = [number for place, number in enumerate(missing) if not place or missing[place - 1] < number - 1]
    ends = [number + 1 for place, number in enumerate(missing) if missing[place + 1 : place + 2] != [number + 1]]
    return [range(*each) for each in zip(begins, ends, strict=True)]


def _needed(name: str) -> bool:
    """Return whether flights depend on a file of the folder."""
    return name.startswith((f"{MISSION}/", "crazyflie/")) or name == PAST
