"""``missionc simulate``: what is flown, judged, said and written, and what is refused."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from missionc import ir
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.app import main
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.flight.simulation.disturbance import Disturbance
from missionc.flight.simulation.judge_flight import at_steps, judge, room
from missionc.flight.simulation.trials import TRACKING, Trial, run
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.output.folder import write_folder as write_folder_module
from missionc.output.folder.write_folder import write_folder
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.simulate_folder import simulate
from tests.support.legal_plans import NOTHING, mission_of, moving, still
from tests.support.output_folders import content

Captured = pytest.CaptureFixture[str]

STROLL = """\
mission stroll
time step 0.5 s, horizon 2 s
world (0, 0) to (3, 3)
region near = box (0.2, 0.2) to (1.4, 2.8)
region far = box (1.6, 0.2) to (2.8, 2.8)
obstacle post = disc at (1.5, 2.6) radius 0.1
team drone[2] {
  radius   0.1 m
  dynamics single_integrator(speed <= 0.6 m/s)
  start    at (1.2, 0.6), (1.2, 1.6)
}
solve with smt { nodes = 40 }
require there: every drone: eventually[0, 2 s] far
"""


@cache
def files(text: str = STROLL) -> Mapping[str, bytes]:
    compiled = driver.compile(Source("stroll.mission", text), overrides={})
    assert isinstance(compiled.outcome, Verified)
    return compiled.outcome.files


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    assert write_folder(tmp_path / "out", files(), force=False) is None
    return tmp_path / "out"


def document(capsys: Captured) -> dict[str, object]:
    found = json.loads(capsys.readouterr().out)
    assert isinstance(found, dict)
    return found


# -------------------------------------------------------------------- commands


def test_a_gentle_plan_is_flown_as_required(folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    lines = out.splitlines()
    assert lines[:2] == ["stroll: 1 simulated flight passed", "  2 agents for 2 s, engine quadrotor, seed 0"]
    assert lines[2].startswith("  there  planned 0.")
    assert "flown satisfied" in lines[2]


def test_a_flight_that_is_blown_off_ends_with_3(folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder), "--wind", "8", "--format", "json"]) == 3
    found = document(capsys)
    assert found["passed"] is False
    assert all(each["most"] > TRACKING for each in found["tracking"])  # type: ignore[attr-defined]


def test_json_holds_planned_and_flown_and_the_least_room(folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder), "--format", "json"]) == 0
    found = document(capsys)
    assert [each["name"] for each in found["requirements"]] == ["there"]  # type: ignore[attr-defined]
    assert [each["name"] for each in found["planned"]] == ["there"]  # type: ignore[attr-defined]
    assert [each["subject"] for each in found["room"]] == ["all pairs", "post"]  # type: ignore[attr-defined]
    assert found["diagnostics"] == []


def test_the_written_path_is_judged_by_monitor_as_simulate_judged_it(folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder), "--trace", "flown.csv", "--format", "json"]) == 0
    flown = document(capsys)
    mission = next((folder / "mission").iterdir())
    assert main(["monitor", str(mission), "flown.csv", "--format", "json"]) == 0
    again = document(capsys)
    first, second = flown["requirements"][0], again["requirements"][0]  # type: ignore[index]
    assert first["robustness"] == pytest.approx(second["robustness"], abs=1e-8)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(folder: Path, capsys: Captured) -> None:
    texts, paths = [], []
    for seed in ("3", "3", "4"):
        asked = ["--wind", "0.5,0.3", "--mass-error", "5", "--start-error", "0.01", "--trials", "2", "--seed", seed]
        main(["simulate", str(folder), *asked, "--trace", "flown.csv"])
        texts.append(capsys.readouterr().out)
        paths.append(Path("flown.csv").read_bytes())
    assert texts[0] == texts[1]
    assert paths[0] == paths[1]
    assert paths[0] != paths[2]


def test_several_flights_are_counted_with_their_interval(folder: Path, capsys: Captured) -> None:
    main(["simulate", str(folder), "--trials", "4", "--wind", "0.2", "--format", "json"])
    found = document(capsys)["fractions"]
    assert set(found) == {"there", "tracking", "nothing touched"}  # type: ignore[call-overload]
    there = found["there"]  # type: ignore[index]
    assert (there["held"], there["of"], there["high"]) == (4, 4, 1.0)
    assert 0.3 < there["low"] < there["least"] < 0.7


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (
            "--trials 4 --wind 0.2",
            "success rate at least 47.2 % (one-sided 95 % lower confidence bound)",
        ),
        ("--trials 4 --wind 8", "success rate at least 0.0 %"),
        ("--trials 4", "4 simulated flights passed (identical flights: no random disturbance)"),
        (
            "--trials 2 --latency 0.02 --lose drone[1]@1.9",
            "2 simulated flights passed (identical flights: no random disturbance)",
        ),
        ("", "1 simulated flight passed"),
    ],
)
def test_the_headline_says_no_more_than_the_flights_show(
    asked: str, words: str, folder: Path, capsys: Captured
) -> None:
    main(["simulate", str(folder), *asked.split()])
    assert words in capsys.readouterr().out.splitlines()[0]
    assert words in json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["headline"]


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("ghost@1", "`stroll` has no agent `ghost`"),
        ("drone[0]@2.5", "`drone[0]` cannot be lost at 2.5 s: the flight ends at 2 s"),
    ],
)
def test_who_is_not_there_cannot_be_lost(value: str, words: str, folder: Path, capsys: Captured) -> None:
    before = content(folder)
    assert main(["simulate", str(folder), "--lose", value]) == 1
    said = capsys.readouterr().err
    assert "MC730" in said
    assert words in said
    assert "write `--lose AGENT@T` with an agent of `drone[0]`, `drone[1]` and a time from 0 to 2 s" in said
    assert content(folder) == before


@pytest.mark.parametrize("value", ["drone[0]", "drone[0]@", "@1", "drone[0]@-1", "drone[0]@nan", "drone[0]@inf"])
def test_a_loss_is_an_agent_and_a_second(value: str, folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder), "--lose", value]) == 2
    assert "is not an agent and a time; write AGENT@SECONDS, such as drone[0]@5" in capsys.readouterr().err


def test_nobody_is_lost_twice(folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder), "--lose", "drone[0]@1", "--lose", "drone[0]@1.5"]) == 2
    assert "`drone[0]` is lost more than once" in capsys.readouterr().err


def test_a_lost_one_is_asked_to_track_until_it_is_lost(folder: Path, capsys: Captured) -> None:
    main(["simulate", str(folder), "--lose", "drone[1]@0.5", "--format", "json"])
    first, second = document(capsys)["tracking"]  # type: ignore[misc]
    assert second["at"] < 0.5
    assert first["most"] < TRACKING
    assert second["most"] < TRACKING


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_picture_is_the_same_each_time(folder: Path, kind: str) -> None:
    pytest.importorskip("matplotlib")
    pictures = []
    for _ in range(2):
        main(["simulate", str(folder), "--trials", "2", "--wind", "0.3,0.1", "--plot", f"flights.{kind}"])
        pictures.append(Path(f"flights.{kind}").read_bytes())
    assert pictures[0] == pictures[1]
    assert pictures[0].startswith(b"\x89PNG" if kind == "png" else b"<?xml")


@pytest.mark.parametrize(
    "asked",
    [
        ["--wind", "strong"],
        ["--wind", "1,2,3"],
        ["--wind", "-1"],
        ["--wind", "nan"],
        ["--trials", "0"],
        ["--plot", "flights.gif"],
        ["--engine", "rotorpy", "--trials", "2"],
        ["--engine", "crazyflow", "--wind", "1"],
    ],
)
def test_what_makes_no_sense_is_a_usage_error(folder: Path, asked: list[str]) -> None:
    assert main(["simulate", str(folder), *asked]) == 2


def test_an_engine_that_is_not_installed_is_refused_with_the_command_that_installs_it(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missionc.flight.simulation.engines.find_spec", lambda name: None)
    assert main(["simulate", str(folder), "--engine", "rotorpy"]) == 1
    assert "MC404" in (err := capsys.readouterr().err)
    assert "pip install 'missionc[rotorpy]'" in err


def test_a_full_disk_leaves_the_folder_as_it_was_before_it_was_flown(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, held: bytes, mode: int = 0o666) -> None:
        if path.name == "report.html":
            raise OSError(errno.ENOSPC, "No space left on device")
        create(path, held, mode)

    create, before = write_folder_module.create, content(folder)
    monkeypatch.setattr(write_folder_module, "create", full)
    assert main(["simulate", str(folder), "--format", "json"]) == 1
    assert [each["code"] for each in document(capsys)["diagnostics"]] == ["MC702"]  # type: ignore[attr-defined]
    assert content(folder) == before
    assert [path.name for path in folder.parent.iterdir()] == ["out"]


def test_what_somebody_put_into_the_folder_stays_beside_the_flight(folder: Path) -> None:
    (folder / "notes.txt").write_text("dear")
    assert main(["simulate", str(folder), "--quiet"]) == 0
    assert (folder / "notes.txt").read_text() == "dear"
    assert (folder / "simulation.json").exists()


def test_the_folder_that_somebody_works_in_stays_the_same_one(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert main(["simulate", ".", "--quiet"]) == 0
    assert Path("simulation.json").exists()


def test_a_folder_without_a_manifest_is_refused(tmp_path: Path, capsys: Captured) -> None:
    assert main(["simulate", str(tmp_path)]) == 1
    assert "MC708" in capsys.readouterr().err


def test_polynomials_that_cannot_be_read_are_refused(folder: Path, capsys: Captured) -> None:
    (folder / "crazyflie" / "drone1.csv").write_text("duration\n")
    assert main(["simulate", str(folder)]) == 1
    err = capsys.readouterr().err
    assert "MC709" in err
    assert "drone[1]" in err


def test_polynomials_that_lead_beyond_all_numbers_are_refused(folder: Path, capsys: Captured) -> None:
    path = folder / "crazyflie" / "drone1.csv"
    lines = path.read_text().split("\n")
    words = lines[2].split(",")
    words[5] = "3e38"
    path.write_text("\n".join([*lines[:2], ",".join(words), *lines[3:]]))
    assert main(["simulate", str(folder)]) == 1
    err = capsys.readouterr().err
    assert "MC709" in err
    assert "the polynomials of `drone[1]` exceed 1e+09 m, m/s or m/s^2" in err


def test_a_place_one_cannot_write_to_is_refused_before_anything_is_flown(folder: Path, capsys: Captured) -> None:
    assert main(["simulate", str(folder), "--trace", "nowhere/flown.csv"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "MC702" in err


def test_a_folder_changed_by_hand_is_flown_as_it_is_and_says_so(folder: Path, capsys: Captured) -> None:
    path = folder / "crazyflie" / "drone0.csv"
    rows = path.read_text().splitlines()
    # The first piece, a second time: a flight that jumps back.
    path.write_text("\n".join([*rows[:2], rows[1], *rows[2:]]) + "\n")
    assert main(["simulate", str(folder)]) == 3
    assert "warning: 1 file changed after compilation" in capsys.readouterr().out


def test_what_was_flown_lies_in_the_folder_which_still_verifies(folder: Path, capsys: Captured) -> None:
    before = (folder / "report.html").read_bytes()
    assert main(["simulate", str(folder)]) == 0
    left = json.loads((folder / "simulation.json").read_text(encoding="utf-8"))
    assert (left["engine"], left["passed"]) == ("quadrotor", True)
    assert [len(left["flight"]["agents"]["drone[0]"][axis]) for axis in range(3)] == [51, 51, 51]
    page = (folder / "report.html").read_bytes()
    assert b'"simulated":{' in page
    assert b'"simulated":{' not in before
    assert main(["verify", str(folder)]) == 0
    assert main(["report", str(folder), "-o", "again.html"]) == 0
    assert Path("again.html").read_bytes() == page
    assert main(["simulate", str(folder), "--wind", "1", "--seed", "3"]) in (0, 3)
    assert json.loads((folder / "simulation.json").read_text(encoding="utf-8"))["seed"] == 3
    assert main(["verify", str(folder)]) == 0
    assert write_folder(folder, files(), force=True) is None
    assert not (folder / "simulation.json").exists()


def test_a_simulation_changed_by_hand_is_refused_and_so_is_what_was_changed_before(
    folder: Path, capsys: Captured
) -> None:
    csv = folder / "trajectories.csv"
    csv.write_text(csv.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert main(["simulate", str(folder)]) == 0
    assert main(["verify", str(folder)]) == 5
    assert "trajectories.csv" in capsys.readouterr().err
    csv.write_text(csv.read_text(encoding="utf-8").removesuffix("\n"), encoding="utf-8")
    assert write_folder(folder, files(), force=True) is None
    assert main(["simulate", str(folder)]) == 0
    path = folder / "simulation.json"
    path.write_text(path.read_text(encoding="utf-8").replace('"seed": 0', '"seed": 1'), encoding="utf-8")
    assert main(["verify", str(folder)]) == 5
    assert "simulation.json" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["simulation.json", "report.html"])
@pytest.mark.parametrize("how", ["changed", "a link"])
def test_a_file_that_somebody_put_where_the_flight_would_lie_is_left_alone(
    name: str, how: str, folder: Path, capsys: Captured
) -> None:
    mine = folder.parent / "mine"
    mine.write_bytes((folder / name).read_bytes() if (folder / name).exists() else b"dear")
    (folder / name).unlink(missing_ok=True)
    if how == "a link":
        (folder / name).symlink_to(mine)
    else:
        (folder / name).write_text("dear")
    before = content(folder)
    assert main(["simulate", str(folder)]) == 1
    said = capsys.readouterr()
    if how == "a link":
        assert f"MC708]: `{folder}` is not a plan folder" in said.err
        assert f"is not a plan folder: its `{name}` is a symbolic link" in said.err
    else:
        assert "MC701" in said.err
        assert f"{name}` exists" in said.err
        assert "satisfied" in said.out, "what was flown is said all the same"
    assert content(folder) == before


@pytest.mark.parametrize("flag", ["--trace", "--plot"])
def test_a_file_of_the_folder_that_is_flown_is_not_written_over(flag: str, folder: Path, capsys: Captured) -> None:
    before = content(folder)
    name = "plan.json" if flag == "--trace" else "map.svg"
    assert main(["simulate", str(folder), flag, str(folder / name)]) == 1
    assert "MC702" in capsys.readouterr().err
    assert content(folder) == before


def test_nothing_that_plans_or_fits_is_loaded(folder: Path) -> None:
    program = (
        "import sys; from missionc.__main__ import main; sys.argv = ['missionc', 'simulate', sys.argv[1]]\n"
        "try: main()\n"
        "except SystemExit as left: assert not left.code, left.code\n"
        "print(sorted({name.split('.')[0] for name in sys.modules} & {'z3', 'torch', 'piqp', 'pysat', 'matplotlib'}))"
    )
    ran = subprocess.run([sys.executable, "-c", program, str(folder)], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1] == "[]"


# -------------------------------------------------------------------- judgement


def test_an_agent_may_be_off_as_far_as_its_vehicle_says(folder: Path) -> None:
    reopened = read_folder(folder)
    assert isinstance(reopened, OutputFolder)
    found = [read(reopened.flights[agent.name]) for agent in reopened.mission.agents]
    pieces = [own for own in found if isinstance(own, Pieces)]
    careful = replace(reopened.mission.agents[0].vehicle, tracking=1e-4)
    agents = (replace(reopened.mission.agents[0], vehicle=careful), *reopened.mission.agents[1:])
    trials = run(replace(reopened.mission, agents=agents), reopened.kernel, pieces, Trial())
    assert trials.allowed.tolist() == [1e-4, TRACKING]
    assert not trials.tracked(trials.flights[0])


def test_flights_are_judged_alike_however_many_are_in_the_air_together(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = Trial(flights=3, disturbance=Disturbance(wind=0.5, gust=0.2, mass=0.05), kept=2)
    together = simulate(folder, trial).trials
    monkeypatch.setattr("missionc.flight.simulation.trials.MOST_BYTES", 1)
    alone = simulate(folder, trial).trials
    assert together is not None
    assert alone is not None
    assert alone.flown.position.shape[0] == together.flown.position.shape[0] == 2
    for first, second in zip(together.flights, alone.flights, strict=True):
        assert np.allclose(first.trace.position, second.trace.position, rtol=0, atol=1e-12)
        assert first.requirements[0].robustness == pytest.approx(second.requirements[0].robustness, abs=1e-12)


def test_error_and_trace_are_those_of_the_path() -> None:
    mission = replace(mission_of([(0.0, 1.0)], 3), step=Seconds(0.25))
    times = np.arange(76) / 100
    planned = np.stack([times, np.ones(76), np.ones(76)], axis=-1)[None]
    position = planned + np.where(times > 0.5, 0.03, 0.01)[:, None] * np.array([0.0, 0.6, 0.8])
    velocity = np.broadcast_to(np.array([1.0, 0.0, 0.0]), position.shape)
    flight = judge(mission, NOTHING, times, planned, position, velocity, np.zeros((1, 76)))
    (error,) = flight.error
    assert error.mean == pytest.approx((51 * 0.01 + 25 * 0.03) / 76)
    assert (error.usual, error.most, error.at) == pytest.approx((0.03, 0.03, 0.51), abs=1e-9)
    assert flight.trace.position[0, :, 0].tolist() == pytest.approx([0, 0.25, 0.5, 0.75])
    assert flight.trace.position[0, 3, 1] == pytest.approx(1.018)


def test_a_step_between_two_samples_lies_between_them() -> None:
    mission = replace(mission_of([(0.0, 0.0)], 3), step=Seconds(1 / 3))
    times = np.arange(101) / 100
    position = np.stack([times, 2 * times, np.ones(101)], axis=-1)[None]
    trace = at_steps(mission, times, position, position, np.zeros((1, 101)))
    assert trace.position[0, :, 0] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    assert trace.velocity[0, :, 1] == pytest.approx([0, 2 / 3, 4 / 3, 2])


def test_room_is_between_bodies_and_found_between_samples() -> None:
    obstacles = [
        still(ir.Disc((5.0, 5.0), 1.0), "post"),
        moving(ir.Disc((9.0, 0.0), 0.5), [0.0, 2.0], [(0, 0), (0, 4)]),
    ]
    mission = mission_of([(0.0, 5.0), (2.0, 0.0)], 2, radius=0.2, separation=0.7, clearance=0.3, obstacles=obstacles)
    times = np.array([0.0, 1.0, 2.0])
    position = np.zeros((2, 3, 3))
    position[0, :, :2] = [(0, 5), (3.5, 5), (3.5, 5)]
    # The other one passes 1.1 m from where the first is, halfway through the second.
    position[1, :, :2] = [(2.0, 0.0), (2.4, 0.0), (2.4, 10.0)]
    margins = {check.name + check.subject: check.margin for check in room(mission, times, position)}
    assert margins["separationall pairs"] == pytest.approx(1.1 - 0.4, abs=1e-4)
    assert margins["obstaclepost"] == pytest.approx(0.5 - 0.2, abs=1e-3)


# --------------------------------------------------------------- other engines


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["rotorpy", "crazyflow"])
def test_another_engine_flies_the_same_polynomials(tmp_path: Path, engine: str) -> None:
    if not find_spec(engine):
        pytest.skip(f"{engine} is not installed")
    slowly = STROLL.replace("2 s", "8 s").replace("0.5 s", "2 s")
    assert write_folder(tmp_path / "slow", files(slowly), force=False) is None
    asked = [
        sys.executable,
        "-m",
        "missionc",
        "simulate",
        str(tmp_path / "slow"),
        "--engine",
        engine,
        "--format",
        "json",
    ]
    # A process of its own: crazyflow has to be there before scipy.
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[3])}
    ran = subprocess.run(asked, capture_output=True, text=True, check=False, env=environment)
    found = json.loads(ran.stdout)
    assert found["engine"] == engine
    assert all(each["most"] < TRACKING for each in found["tracking"])
    assert [each["satisfied"] for each in found["requirements"]] == [True]
