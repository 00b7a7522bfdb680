"""A folder's simulation flown once more: it says what its flights come to, or ``missionc verify`` refuses it."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.base.limits import Limits
from missionc.cli.app import main
from missionc.flight.simulation.default_engine import Flown, sample_times
from missionc.flight.simulation.disturbance import Disturbance, setpoints
from missionc.flight.simulation.flight_conditions import conditions, trial_of
from missionc.flight.simulation.trial_bounds import ENGINES, LARGEST_SEED, MOST, MOST_FLIGHTS
from missionc.flight.simulation.trials import Trial, Trials
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.output.documents.simulation_json import simulation_json, simulation_record
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.rebuild.simulation_document import _flown as fly_again
from missionc.tools.replay.rebuild.simulation_document import check_simulation, settled
from missionc.tools.replay.rebuild.verdict import DOCUMENT, UNJUDGED
from missionc.tools.replay.render_report import render_report
from missionc.tools.replay.reverify import reverify
from missionc.tools.replay.reverify import reverify_opened as replay_of
from missionc.verification.certificate import Check
from missionc.verification.compare_documents import SAME
from missionc.verification.monitoring.monitor import monitor
from missionc.version import __version__
from tests.support.forged_folders import Files, forged, laid
from tests.support.legal_plans import mission_of
from tests.support.whole_folder import files as undisturbed

Change = Callable[[Any], object]
DISTURBED = (
    "--trials 2 --wind 0.2,0.1 --mass-error 3 --start-error 0.01 --clock-error 0.02 --noise 0.002 --latency 0.01 "
    "--packet-loss 5 --missed-start 1 --battery-sag 5 --weak-motor 2 --downwash 0.5 --lose drone[1]@1.9"
)


@cache
def files() -> Files:
    """Of a folder that was flown twice, disturbed by everything there is."""
    with tempfile.TemporaryDirectory() as name:
        folder = laid(Path(name) / "out", undisturbed())
        assert main(["simulate", str(folder), *DISTURBED.split(), "--seed", "5"]) in (0, 3)
        return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@cache
def opened() -> OutputFolder:
    with tempfile.TemporaryDirectory() as name:
        found = read_folder(laid(Path(name), files()))
    assert isinstance(found, OutputFolder)
    return found


@pytest.fixture(autouse=True)
def once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same flights are flown once for all tests."""
    opened()
    monkeypatch.setattr(
        "missionc.tools.replay.rebuild.simulation_document._flown", lambda reopened, trial: flown(trial)
    )


@cache
def flown(trial: Trial) -> Trials:
    return fly_again(opened(), trial)


def edited(change: Change) -> bytes:
    """Another simulation."""
    document = json.loads(files()["simulation.json"])
    change(document)
    return json.dumps(document).encode()


def judged(simulation: bytes, limits: Limits | None = None) -> Check:
    """The check of a folder with another simulation, whatever the hashes in its manifest are."""
    reopened = replace(opened(), files={**opened().files, "simulation.json": simulation})
    return check_simulation(reopened, limits or Limits())


def test_an_honest_simulation_passes(tmp_path: Path) -> None:
    assert reverify(laid(tmp_path, files())).passed
    assert judged(files()["simulation.json"]).passed


# ------------------------------------------------------------ what flights came to


def places(found: Any) -> list[float]:
    axis = found["flight"]["agents"]["drone[0]"][0]
    assert isinstance(axis, list)
    return axis


def test_a_figure_that_no_flight_came_to_is_refused(subtests: pytest.Subtests) -> None:
    for change, words in [
        (lambda found: found.update(passed=not found["passed"]), "`passed`"),
        (lambda found: found["planned"][0].update(robustness=9.99), "`planned[0].robustness`"),
        (lambda found: found["requirements"][0].update(robustness=0.5), "`requirements[0].robustness`"),
        (lambda found: found["requirements"][0].update(satisfied=False), "`requirements[0].satisfied`"),
        (lambda found: found["requirements"][0].update(step=1), "`requirements[0].step`"),
        (lambda found: found["requirements"][0].update(agents=["drone[0]"]), "`requirements[0].agents`"),
        (lambda found: found["requirements"][0].update(name="other"), "`requirements[0].name`"),
        (lambda found: found["fractions"]["tracking"].update(held=1), "`fractions.tracking.held`"),
        (lambda found: found["fractions"]["tracking"].update(low=0.9), "`fractions.tracking.low`"),
        (lambda found: found.update(headline="in at least 99.9 % of such flights"), "`headline`"),
        (lambda found: found["kept"].update(held=found["kept"]["held"] + 1), "`kept.held`"),
        (lambda found: found["tracking"][0].update(allowed=1.0), "`tracking[0].allowed`"),
        (lambda found: found["tracking"][0].update(mean=0.0), "`tracking[0].mean`"),
        (lambda found: found["tracking"][0].update(usual=0.0), "`tracking[0].usual`"),
        (lambda found: found["tracking"][0].update(most=1e-9), "`tracking[0].most`"),
        (lambda found: found["tracking"][1].update(at=0.0), "`tracking[1].at`"),
        (lambda found: found["tracking"].reverse(), "`tracking[0].agent`"),
        (lambda found: found["room"][0].update(margin=found["room"][0]["margin"] + 1e-4), "`room[0].margin`"),
        (lambda found: found["room"][0].update(at=0.0), "`room[0].at`"),
        (lambda found: found["room"][1].update(agents=[]), "`room[1].agents`"),
        (lambda found: found["room"][0].update(agents=["drone[1]", "drone[0]"]), "`room[0].agents"),
        (lambda found: found.update(room=[]), "`room`"),
        (lambda found: found["robustness"]["near"].__setitem__(1, 0.7), "`robustness.near[1]`"),
        (lambda found: found["robustness"]["near"].append(0.7), "`robustness.near`"),
        (lambda found: places(found).__setitem__(9, places(found)[9] + 1e-3), "`flight.agents.drone[0][0][9]`"),
        (lambda found: places(found).pop(), "`flight.agents.drone[0][0]`"),
        (lambda found: places(found).__setitem__(0, 1e308), "`flight.agents.drone[0][0][0]`"),
        (lambda found: found["flight"].update(samples_per_second=50), "`flight.samples_per_second`"),
        (lambda found: found.pop("flight"), "`flight`"),
        (lambda found: found.update(approved_by="nobody"), "`approved_by`"),
        (lambda found: found.clear(), "`schema`"),
    ]:
        with subtests.test(change=change, words=words):
            check = judged(edited(change))
            assert (check.name, check.passed) == (DOCUMENT, False)
            assert words in check.detail


# --------------------------------------------------------------- what decided them


def worse(name: str, value: object) -> Change:
    return lambda found: found["disturbance"].update({name: value})


@pytest.mark.parametrize(
    "change",
    [
        worse("wind", 0.1),
        worse("gust", 0.0),
        worse("mass", 0.05),
        worse("start", 0.0),
        worse("clock", 0.0),
        worse("noise", 0.003),
        worse("latency", 0.0),
        worse("packets", 0.5),
        worse("missed", 1.0),
        worse("battery", 0.9),
        worse("motor", 0.03),
        worse("lose", [["drone[0]", 1.9]]),
        worse("lose", [["drone[1]", 0.5]]),
        worse("lose", []),
        lambda found: found.update(seed=6),
        lambda found: found.update(flights=1),
        lambda found: found.update(flights=3),
    ],
)
def test_other_disturbances_are_refused_since_they_fly_otherwise(change: Change) -> None:
    check = judged(edited(change))
    assert (check.name, check.passed) == (DOCUMENT, False)
    assert "but the files give" in check.detail


@pytest.mark.parametrize("name", ["flight", "setpoint", "command", "gust", "noise"])
@pytest.mark.parametrize("value", [1e-300, 1e308, float("nan"), 0, -1.0, 2**62, "1", None, [], True])
def test_no_other_length_of_time_is_flown(name: str, value: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.tools.replay.rebuild.simulation_document._flown", None)
    check = judged(edited(lambda found: found["seconds"].update({name: value})))
    assert (check.name, check.passed) == (DOCUMENT, False)
    assert f"`seconds.{name}`" in check.detail


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda found: found["vehicle"].update(mass=0.0291), "`vehicle.mass`"),
        (lambda found: found["vehicle"]["inertia"].__setitem__(0, 1.6571e-5), "`vehicle.inertia[0]`"),
        (lambda found: found["controller"].update(mass=1e-300), "`controller.mass`"),
        (lambda found: found.update(vehicle="rotorpy"), "`vehicle`"),
        (lambda found: found.update(engine="rotorpy"), "`disturbance`"),
        (lambda found: found.update(engine="wings"), "`engine`"),
        (lambda found: found.update(engine=["quadrotor"]), "`engine`"),
        (lambda found: found.update(seed=-1), "`seed`"),
        (lambda found: found.update(seed=2**32), "`seed`"),
        (lambda found: found.update(seed=5.0), "`seed`"),
        (lambda found: found.update(flights=True), "`flights`"),
        (lambda found: found.update(flights=0), "`flights`"),
        (lambda found: found.update(flights=10**9), "`flights`"),
        (worse("wind", -1), "`disturbance`"),
        (worse("gust", 1e308), "`disturbance`"),
        (worse("mass", float("nan")), "`disturbance`"),
        (worse("start", float("inf")), "`disturbance`"),
        (worse("clock", "0.1"), "`disturbance`"),
        (worse("rain", 1.0), "`disturbance`"),
        (worse("noise", 1.1), "`disturbance`"),
        (worse("packets", 1.1), "`disturbance`"),
        (worse("lose", None), "`disturbance`"),
        (worse("lose", ["drone[1]"]), "`disturbance`"),
        (worse("lose", [["drone[1]", -1]]), "`disturbance`"),
        (worse("lose", [["drone[1]", 1e400]]), "`disturbance`"),
        (worse("lose", [["drone[1]", 1.0], ["drone[1]", 1.5]]), "`disturbance`"),
        (worse("lose", [["drone[1]", 60.0]]), "`disturbance`"),
        (worse("lose", [["nobody", 1.0]]), "`disturbance`"),
        (worse("lose", [["drone[1]", 1.0]] * 2000), "`disturbance`"),
        (lambda found: found["disturbance"].pop("wind"), "`disturbance`"),
        (lambda found: found.update(disturbance=None), "`disturbance`"),
        (lambda found: found.pop("versions"), "`versions`"),
        (lambda found: found["versions"].update(sabotage="1"), "`versions`"),
        (lambda found: found["versions"].update(missionc="\x1b[2J"), "`versions`"),
        (lambda found: found.update(schema="missionc.simulation/9"), "`schema`"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_flown(
    change: Change, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missionc.tools.replay.rebuild.simulation_document._flown", None)
    check = judged(edited(change))
    assert (check.name, check.passed) == (DOCUMENT, False)
    assert words in check.detail


def test_every_strange_value_is_refused(subtests: pytest.Subtests) -> None:
    for text, key in product(
        ["9" * 400, "NaN", "1e400", "-Infinity", "1e-300", "[" * 5_000 + "]" * 5_000],
        ["seed", "flights", "disturbance", "seconds", "vehicle", "versions"],
    ):
        with subtests.test(text=text, key=key):
            simulation = edited(lambda document, key=key: document.update({key: "@@@"})).replace(
                b'"@@@"', text.encode()
            )
            assert not judged(simulation).passed


def test_everything_that_the_command_takes_can_be_told() -> None:
    assert {*MOST, "lose"} == {field.name for field in fields(Disturbance)}
    most = Trial(flights=MOST_FLIGHTS, disturbance=Disturbance(**MOST), seed=LARGEST_SEED)
    assert trial_of(json.loads(json.dumps(conditions(most, 4.0)))) == most


# ------------------------------------------------------ what cannot be judged here


def oldest(found: Any) -> None:
    """As it was before it told what it was flown through."""
    old(found)
    found["schema"] = "missionc.simulation/1"
    for key in ("versions", "disturbance", "seconds", "vehicle", "controller"):
        del found[key]


def old(found: Any) -> None:
    """As it was before there was more than wind, mass, start and clock, and before it had a headline."""
    found["schema"] = "missionc.simulation/2"
    found["controller"]["integral"][2] = 1.5
    found["disturbance"] = {name: found["disturbance"][name] for name in ("wind", "gust", "mass", "start", "clock")}
    for part, key in (
        (found, "headline"),
        (found, "kept"),
        (found["seconds"], "noise"),
        (found["controller"], "settle"),
    ):
        del part[key]


def by(engine: str) -> Change:
    """As another engine's simulation begins."""
    return lambda found: found.update(
        json.loads(json.dumps(conditions(Trial(engine), found["seconds"]["flight"])))
        | {"versions": {"missionc": __version__, engine: "3.0.0"}}
    )


def folder_with(folder: Path, change: Change) -> Path:
    """A folder in which nothing else is wrong: its page shows this simulation."""
    found = {**files(), "simulation.json": edited(change)}
    reopened = read_folder(forged(folder, found))
    assert isinstance(reopened, OutputFolder)
    return forged(folder, {**found, "report.html": render_report(replay_of(reopened, None))})


def said(folder: Path, capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    status = main([words[0], str(folder), *words[1:]] if words else ["verify", str(folder)])
    return status, " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("form", [old, oldest])
def test_an_older_simulation_is_to_be_flown_again(
    form: Change, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_with(tmp_path / "out", form)
    status, err = said(folder, capsys)
    assert status == 4
    assert "MC713" in err
    assert "has an older format: `missionc simulate` repeats and replaces it" in err
    assert main(["simulate", str(folder), "--quiet"]) in (0, 3)
    assert json.loads((folder / "simulation.json").read_text())["schema"] == "missionc.simulation/4"


def test_every_command_tells_what_cannot_be_judged_from_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_with(tmp_path / "out", old)
    for words in (["report", "-o", str(tmp_path / "page.html")], ["export", "px4", "-o", str(tmp_path / "px4")]):
        status, err = said(folder, capsys, *words)
        assert status == 4
        assert "MC713" in err
    assert not (tmp_path / "px4").exists()
    (folder / "trajectories.csv").write_text("")
    status, err = said(folder, capsys)
    assert status == 5
    assert "MC709" in err
    assert "`missionc simulate` repeats and replaces it" in err


def test_an_engine_that_is_not_installed_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.flight.simulation.engines.find_spec", lambda name: None)
    check = judged(edited(by("rotorpy")))
    assert check.name == UNJUDGED
    assert "`pip install 'missionc[rotorpy]'`" in check.detail


def test_another_version_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    check = judged(edited(lambda found: found["versions"].update(missionc="0.0.9")))
    assert check.name == UNJUDGED
    assert "`versions.missionc` is `0.0.9`" in check.detail
    monkeypatch.setattr("missionc.flight.simulation.engines.find_spec", lambda name: name)
    monkeypatch.setattr("missionc.flight.simulation.flight_conditions.version", lambda name: "3.1.0")
    check = judged(edited(by("rotorpy")))
    assert check.name == UNJUDGED
    assert "`versions.rotorpy` is `3.0.0`" in check.detail


def test_an_engine_that_does_not_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.flight.simulation.engines.find_spec", lambda name: name)
    monkeypatch.setattr("missionc.flight.simulation.flight_conditions.version", lambda name: "3.0.0")
    monkeypatch.setitem(ENGINES._values, "rotorpy", "no_jax:fly")
    check = judged(edited(by("rotorpy")))
    assert check.name == UNJUDGED
    assert (
        "rotorpy cannot run here: No module named 'no_jax'; `missionc simulate` repeats and replaces it" in check.detail
    )


def test_another_engine_flies_its_simulation_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """With an engine that flies everybody through where they should be."""

    def fly(pieces: list[Pieces], seconds: float) -> Flown:
        times = sample_times(seconds)
        told = np.stack([setpoints(own, times) for own in pieces])[None]
        position, velocity = (np.moveaxis(told[:, :, rows], 2, -1) for rows in (slice(0, 3), slice(3, 6)))
        return Flown(times, position, velocity, told[:, :, 12])

    monkeypatch.setattr("missionc.flight.simulation.engines.find_spec", lambda name: name)
    monkeypatch.setattr("missionc.flight.simulation.flight_conditions.version", lambda name: "3.0.0")
    monkeypatch.setitem(ENGINES._values, "rotorpy", fly)
    trials = fly_again(opened(), Trial("rotorpy"))
    planned = monitor(opened().mission, opened().kernel, opened().trace).requirements
    made = simulation_record(opened().mission, planned, trials)
    assert judged(simulation_json(opened().mission, made, trials.flown)).passed
    made["tracking"][0]["most"] += 1e-3  # type: ignore[index]
    check = judged(simulation_json(opened().mission, made, trials.flown))
    assert "`tracking[0].most`" in check.detail


def test_more_flights_than_the_limit_allows_are_not_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.tools.replay.rebuild.simulation_document._flown", None)
    check = judged(edited(lambda found: found.update(flights=100_000)))
    assert check.name == UNJUDGED
    assert "`--limit simulated_seconds=800000`" in check.detail
    monkeypatch.undo()
    assert judged(files()["simulation.json"], Limits(simulated_seconds=16)).passed
    assert judged(files()["simulation.json"], Limits(simulated_seconds=15)).name == UNJUDGED


def test_what_was_flown_just_now_is_not_flown_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.tools.replay.rebuild.simulation_document._flown", None)
    assert main(["simulate", str(laid(tmp_path, files())), "--quiet"]) in (0, 3)


# ----------------------------------------------------------------------------- ties


def test_who_stands_is_worst_at_any_time_and_who_comes_twice_as_near_at_either() -> None:
    """Two agents fly past each other, and wait there: rounding decides which moment is told."""
    mission = mission_of([(0.0, 0.0), (2.0, 0.0), (4.0, 0.0)], 1, radius=0.1)
    times = np.arange(101) / 100
    position = np.zeros((1, 3, 101, 3))
    position[0, :, :, 0] = [[0.0], [2.0], [4.0]]
    flown = Flown(times, position, np.zeros_like(position), np.zeros((1, 3, 101)))
    trials = Trials(Trial(), np.full(3, 0.05), position[0].copy(), flown, ())
    row = {"subject": "all pairs", "margin": 1.8, "at": 0.0, "agents": ["agent[0]", "agent[1]"]}
    made = {"tracking": [{"agent": "agent[0]", "most": 0.0, "at": 0.0}], "room": [row]}

    def same(tracking: float, room: float, agents: list[str], margin: float = 1.8) -> tuple[bool, bool]:
        said = {
            "tracking": [{**made["tracking"][0], "at": tracking}],
            "room": [{**row, "at": room, "agents": agents, "margin": margin}],
        }
        found = settled(said, made, mission, trials, SAME)
        return found["tracking"] == said["tracking"], found["room"] == said["room"]

    names = [agent.name for agent in mission.agents]
    made["room"][0]["agents"] = names[:2]
    assert same(0.5, 0.5, names[1:]) == (True, True)
    assert same(0.505, 0.5, [names[0], names[2]]) == (False, False)
    assert same(1.5, 1.5, names[1:]) == (False, False)
    assert same(0.0, 0.3, names[:1]) == (True, False)
    assert same(0.0, 0.3, names[:2], margin=1.8 - 5e-6) == (True, True)
    assert same(0.0, 0.3, names[:2], margin=1.7) == (True, False)
    trials.flown.position[0, 0, :50, 0] = 0.1
    made["tracking"][0]["most"] = 0.1
    assert same(0.2, 0.7, names[:2]) == (True, True)
    assert same(0.7, 0.7, names[:2]) == (False, True)
