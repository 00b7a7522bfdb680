"""Flights that are spread over workers: the same numbers, however many there are and whatever each is given."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from missionc.base.limits import Limits
from missionc.cli.app import main
from missionc.output.documents.simulation_json import simulation_record
from missionc.replay.simulate_folder import Simulated, simulate
from missionc.simulate.disturbance import Disturbance
from missionc.simulate.trials import Trial
from missionc.sweep import run_answer, spread_trials, trial_request
from missionc.sweep.carry_out_trials import carry_out
from missionc.sweep.executors import Pool
from missionc.sweep.spread_trials import NotFlown, SpreadTrials
from tests.support.small_missions import SMALL

TRIAL = Trial(flights=8, disturbance=Disturbance(wind=0.4, gust=0.2, mass=0.05, noise=0.01), seed=3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("flown")
    (home / "small.mission").write_text(SMALL, encoding="utf-8")
    assert main(["compile", str(home / "small.mission"), "-o", str(home / "out"), "--quiet"]) == 0
    return home / "out"


def answer_to(text: str) -> str:
    """What a worker answers, without a process of its own."""
    return run_answer.written(carry_out(trial_request.read(text)))


def record(simulated: Simulated) -> dict[str, object]:
    assert simulated.opened is not None
    assert simulated.planned is not None
    assert simulated.trials is not None
    return simulation_record(simulated.opened.mission, simulated.planned.requirements, simulated.trials)


def test_flights_are_the_same_whoever_flies_them(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    alone = simulate(folder, TRIAL)
    asked: list[str] = []

    def answer(text: str) -> str:
        asked.append(text)
        return answer_to(text)

    for workers, together, requests in ((3, 2, 4), (2, 1000, 2)):
        asked.clear()
        monkeypatch.setattr(spread_trials, "MOST_TOGETHER", together)
        heard: list[int] = []
        with ThreadPoolExecutor(1) as executor:
            fly = SpreadTrials(Pool(executor, answer, lambda workers=workers: workers), Limits(), curves=True)
            spread = simulate(folder, TRIAL, None, heard.append, fly)
        assert len(asked) == requests
        assert heard[-1] == TRIAL.flights
        assert record(spread) == record(alone)
        assert spread.trials is not None
        assert alone.trials is not None
        for mine, theirs in zip(spread.trials.flights, alone.trials.flights, strict=True):
            assert (mine.error, mine.requirements, mine.preferences, mine.room) == (
                theirs.error,
                theirs.requirements,
                theirs.preferences,
                theirs.room,
            )
            assert mine.largest.tobytes() == theirs.largest.tobytes()


def test_a_worker_that_cannot_fly_says_so(folder: Path) -> None:
    with ThreadPoolExecutor(1) as executor:
        refused = Pool(executor, lambda text: run_answer.other_versions({"missionc": "0.0"}), lambda: 1)
        with pytest.raises(NotFlown, match="other versions"):
            simulate(folder, TRIAL, fly=SpreadTrials(refused, Limits()))


@pytest.mark.slow
def test_the_command_leaves_the_same_bytes_with_processes_and_on_a_cluster(folder: Path) -> None:
    pytest.importorskip("distributed", reason="distributed is not installed")
    left = []
    for words in ([], ["--jobs", "2"], ["--cluster", "local:2"]):
        given = ["--trials", "12", "--wind", "0.4,0.2", "--noise", "0.01", "--quiet", *words]
        assert main(["simulate", str(folder), *given]) in (0, 3)
        left.append((folder / "simulation.json").read_bytes())
    assert left[0] == left[1] == left[2]


class KilledWorker(Exception):
    """Called as what Dask says of a request that it gives up."""


def test_flights_that_a_cluster_gave_up_are_given_to_it_again_a_few_times(folder: Path) -> None:
    few = Trial(flights=2, disturbance=TRIAL.disturbance)
    asked: list[str] = []

    def answer(text: str, deaths: int) -> str:
        asked.append(text)
        if len(asked) <= deaths:
            raise KilledWorker
        return answer_to(text)

    with ThreadPoolExecutor(1) as executor:
        spread = simulate(
            folder, few, fly=SpreadTrials(Pool(executor, lambda text: answer(text, 2), lambda: 1), Limits())
        )
        assert record(spread) == record(simulate(folder, few))
        assert len(asked) == 3
        asked.clear()
        with pytest.raises(NotFlown, match="did not do what it was given"):
            simulate(folder, few, fly=SpreadTrials(Pool(executor, lambda text: answer(text, 99), lambda: 1), Limits()))
        assert len(asked) == 5
