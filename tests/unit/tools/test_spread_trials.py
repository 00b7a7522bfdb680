"""Flights that are spread over workers: the same numbers, however many there are and whatever each is given."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CHECKPOINT_MISMATCH, CHECKPOINT_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.signals import Stopped
from missionc.cli.app import main
from missionc.flight.simulation.disturbance import Disturbance
from missionc.flight.simulation.judge_flight import Flight
from missionc.flight.simulation.trials import Trial
from missionc.output.documents.simulation_json import simulation_record
from missionc.tools.replay.simulate_folder import Simulated, simulate
from missionc.tools.sweep import flights_journal, run_answer, spread_trials, trial_request
from missionc.tools.sweep.carry_out_trials import fly_trials
from missionc.tools.sweep.flights_journal import FlightsJournal
from missionc.tools.sweep.run_sweep import Pool
from missionc.tools.sweep.spread_trials import NotFlown, SpreadTrials
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
    return run_answer.run_answer_text(fly_trials(trial_request.read_trial_request(text)))


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
        with pytest.raises(NotFlown, match="the package versions of a worker on `vm` differ from this machine"):
            simulate(folder, TRIAL, fly=SpreadTrials(refused, Limits()))


def fly(
    folder: Path, file: Path, asked: list[int], *, trial: Trial = TRIAL, workers: int = 3, most: int = 99
) -> Simulated:
    """Fly with a journal; ``asked`` hears of the first flight of each request, and only so many are answered."""

    def answer(text: str) -> str:
        asked.append(trial_request.read_trial_request(text).trial.first)
        return answer_to(text) if len(asked) <= most else run_answer.failed("no more")

    with flights_journal.opened(file) as journal, ThreadPoolExecutor(1) as executor:
        assert isinstance(journal, FlightsJournal)
        pool = Pool(executor, answer, lambda: workers)
        return simulate(folder, trial, fly=SpreadTrials(pool, Limits(), journal=journal))


def test_flights_that_a_journal_holds_are_not_flown_again(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spread_trials, "MOST_TOGETHER", 1)
    file, asked = tmp_path / "flights.jsonl", list[int]()
    with pytest.raises(NotFlown, match="did not finish"):
        fly(folder, file, asked, most=3)
    assert asked[:4] == [1, 2, 3, 4]
    of, one, two, three = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(of + one + three + two[:50])  # as a process leaves it that was killed; nobody flew the second
    asked.clear()
    monkeypatch.setattr(spread_trials, "MOST_TOGETHER", 1000)
    assert record(fly(folder, file, asked, workers=2)) == record(simulate(folder, TRIAL))
    assert asked == [2, 4, 7]
    assert file.read_bytes().startswith(of + one + three + b'{"first":')
    asked.clear()
    fewer, more = replace(TRIAL, flights=5), replace(TRIAL, flights=9)
    assert record(fly(folder, file, asked, trial=fewer)) == record(simulate(folder, fewer))
    assert asked == []
    assert record(fly(folder, file, asked, trial=more)) == record(simulate(folder, more))
    assert asked == [8]


def begun(file: Path, like: Flight, **of: str) -> Diagnostic | None:
    with flights_journal.opened(file) as journal:
        assert isinstance(journal, FlightsJournal)
        return journal.begin({"folder": "f00", "seed": "3", "mass": "0.05", **of}, like)


def test_a_journal_that_does_not_fit_is_left_as_it_is(folder: Path, tmp_path: Path) -> None:
    alone = simulate(folder, Trial())
    assert alone.trials is not None
    like = alone.trials.flights[0]
    file, flights = tmp_path / "flights.jsonl", flights_journal.flights_text([like], False)
    assert begun(file, like) is None
    first = file.read_bytes()
    line = b'{"first":1,"flights":%s}\n' % flights
    strange = b'{"first":1,"flights":[{"error":[],"requirements":[],"preferences":[],"room":[],"largest":""}]}\n'
    for content, code, why in (
        (b"my notes, and no line end", CHECKPOINT_UNREADABLE, "its first line is missing"),
        (b"my notes\n", CHECKPOINT_UNREADABLE, "line 1"),
        (b"{}\n", CHECKPOINT_UNREADABLE, "line 1"),
        (first + b"[]\n", CHECKPOINT_UNREADABLE, "line 2"),
        (
            first + line + strange,
            CHECKPOINT_UNREADABLE,
            "invalid line 3: its flights",
        ),
        (first + line.replace(b'"first":1', b'"first":"1"'), CHECKPOINT_UNREADABLE, "line 2"),
        (first + line.replace(b'"most":', b'"most":"a","usual":'), CHECKPOINT_UNREADABLE, "line 2"),
        (
            first.replace(b'"3"', b'"4"') + line,
            CHECKPOINT_MISMATCH,
            "the seed is `4` in the checkpoint and `3` in this run",
        ),
        (
            first.replace(b',"mass":"0.05"', b""),
            CHECKPOINT_MISMATCH,
            "the mass is not set in the checkpoint and `0.05` in this run",
        ),
        (
            first.replace(b"}}", b',"gust":"1"}}'),
            CHECKPOINT_MISMATCH,
            "the gust is `1` in the checkpoint and not set in this run",
        ),
        (first.replace(b"f00", b"f01"), CHECKPOINT_MISMATCH, "the plan folder is different"),
        (first.replace(b"flights/1", b"flights/9"), CHECKPOINT_MISMATCH, "missionc.flights/9"),
    ):
        file.write_bytes(content)
        wrong = begun(file, like)
        assert wrong is not None
        assert wrong.code == code, content
        assert why in wrong.notes[0]
        assert file.read_bytes() == content
    file.write_bytes(first[:9])
    assert begun(file, like) is None
    assert file.read_bytes() == first
    file.write_bytes(first + line + line[:40])
    assert begun(file, like) is None
    assert file.read_bytes() == first + line


def test_the_command_keeps_flights_in_a_journal(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "flights.jsonl"
    words = ["simulate", str(folder), "--trials", "3", "--wind", "0.4", "--quiet", "--journal"]
    assert main([*words, str(file)]) in (0, 3)
    said, kept = capsys.readouterr().out, file.read_bytes()
    assert main([*words, str(file)]) in (0, 3)
    assert capsys.readouterr().out == said
    assert file.read_bytes() == kept
    with flights_journal.opened(file):
        assert main([*words, str(file)]) == 1
    assert f"error[MC763]: `{file}` is in use by another command" in capsys.readouterr().err
    assert main([*words, str(folder / "manifest.json")]) == 1
    assert "error[MC702]" in capsys.readouterr().err


def test_whoever_interrupts_is_told_how_many_flights_are_kept(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*arguments: object) -> None:
        (flying,) = (each for each in arguments if isinstance(each, SpreadTrials))
        assert flying.journal is not None
        flying.journal.over |= dict.fromkeys(range(1, 8), None)  # type: ignore[arg-type]
        raise Stopped(2)

    monkeypatch.setattr("missionc.tools.replay.simulate_folder.simulate", interrupted)
    words = ["simulate", str(folder), "--trials", "9", "--wind", "0.4", "--quiet", "--journal", str(tmp_path / "kept")]
    with pytest.raises(Stopped):
        main(words)
    assert "7 flights saved; run the same command again to continue" in capsys.readouterr().err


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
        with pytest.raises(NotFlown, match="did not finish its run"):
            simulate(folder, few, fly=SpreadTrials(Pool(executor, lambda text: answer(text, 99), lambda: 1), Limits()))
        assert len(asked) == 5
