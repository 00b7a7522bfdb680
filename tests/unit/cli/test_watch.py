"""``--watch``: every save is seen, however an editor saves, and Ctrl-C ends it."""

from __future__ import annotations

import json
import os
import signal
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from missionc.cli.app import main
from missionc.cli.compile_request import CompileRequest, check
from missionc.cli.watch.file_changes import Saves
from missionc.cli.watch.live_page import LivePage
from missionc.cli.watch.loop import _begin
from missionc.cli.watch.planner_process import Planner
from missionc.cli.watch.watched_missions import Missions
from tests.support.busy_processes import HARD, alive, children
from tests.support.small_missions import CONFLICT, SMALL, WRONG
from tests.support.watch_process import save_by_rename, until, watching

PARTED = SMALL.replace("region goal = box (2.2, 2.2) to (3.8, 3.8)\n", 'include "goal.mission"\n')
GOAL = "region goal = box (2.2, 2.2) to (3.8, 3.8)\n"


def asked(address: str, host: str | None = None) -> tuple[int, str]:
    request = urllib.request.Request(address, headers={"Host": host} if host else {})
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, ""


# --------------------------------------------------------------------- saves


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "a.mission").write_text("one")
    return tmp_path / "a.mission"


@pytest.fixture
def saves(file: Path) -> Saves:
    found = Saves()
    assert found.watch([str(file)])
    assert not found.saved()
    return found


def test_a_save_in_place_is_seen_once(saves: Saves, file: Path) -> None:
    file.write_text("three")
    until(saves.saved, "the save")
    assert not saves.saved()


def test_a_save_by_another_file_of_the_same_length_and_time_is_seen(saves: Saves, file: Path) -> None:
    before = file.stat()
    (file.parent / "beside").write_text("two")
    os.utime(file.parent / "beside", ns=(before.st_atime_ns, before.st_mtime_ns))
    (file.parent / "beside").replace(file)
    until(saves.saved, "the save")


def test_a_file_that_is_away_for_a_moment_is_not_reported_as_gone(saves: Saves, file: Path) -> None:
    file.unlink()
    assert not saves.saved()
    time.sleep(0.3)
    assert not saves.saved()
    file.write_text("two")
    until(saves.saved, "the save")
    assert not saves.saved()


def test_a_file_that_stays_away_is_reported(saves: Saves, file: Path) -> None:
    file.unlink()
    until(saves.saved, "the deletion")


def test_a_burst_of_saves_is_one(saves: Saves, file: Path) -> None:
    for number in range(20):
        file.write_text("x" * number)
        assert not saves.saved()
        time.sleep(0.01)
    until(saves.saved, "the save")
    assert not saves.saved()


def test_what_is_watched_already_keeps_its_unseen_save(saves: Saves, file: Path) -> None:
    file.write_text("three")
    assert not saves.watch([str(file)])
    assert saves.watch([str(file), str(file.parent / "b.mission")])
    until(saves.saved, "the save")


# ------------------------------------------------------------- check --watch


def test_check_goes_on_through_bad_and_good_saves_until_ctrl_c(tmp_path: Path) -> None:
    mission = tmp_path / "a.mission"
    mission.write_text(SMALL)
    with watching(tmp_path, "check", "a.mission", "--watch") as check:
        check.says("a.mission: no findings")
        save_by_rename(mission, WRONG)
        check.says("a.mission: 1 error")
        assert "error[MC101]" in check.said
        mission.unlink()
        mission.write_text(SMALL)
        check.says("a.mission: no findings", 2)
        assert check.end(signal.SIGINT) == 130
        assert "Traceback" not in check.said


def test_check_follows_included_files_even_those_that_are_not_there_yet(tmp_path: Path) -> None:
    (tmp_path / "a.mission").write_text(PARTED)
    with watching(tmp_path, "check", "a.mission", "--watch") as check:
        check.says("a.mission: 1 error")
        assert "cannot read `goal.mission`" in check.said
        (tmp_path / "goal.mission").write_text(GOAL)
        check.says("a.mission: no findings")
        save_by_rename(tmp_path / "goal.mission", GOAL.replace("goal", "gaol"))
        check.says("unknown name `goal`")
        assert check.end(signal.SIGTERM) == 143


@pytest.mark.parametrize(
    "words",
    [
        ["check", "--watch", "--format", "json"],
        ["check", "--watch", "--format", "sarif"],
        ["compile", "--watch", "--format", "json"],
        ["compile", "--watch", "--emit", "ir"],
        ["compile", "--no-open"],
    ],
)
def test_what_does_not_go_with_watching_is_said(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.mission").write_text(SMALL)
    assert main([words[0], "a.mission", *words[1:]]) == 2
    assert "--watch" in capsys.readouterr().err


# ----------------------------------------------------------- compile --watch


def test_compile_plans_after_every_good_save_and_keeps_its_report_through_a_bad_one(tmp_path: Path) -> None:
    mission = tmp_path / "small.mission"
    mission.write_text(SMALL)
    with watching(tmp_path, "compile", "small.mission", "--watch", "--no-open") as run:
        address = run.address()
        run.says("report: build/small/report.html")
        until(lambda: '"report": 1' in news(address), "the first report")
        first = asked(address + "report.html")
        assert first == (200, (tmp_path / "build/small/report.html").read_text(encoding="utf-8"))
        save_by_rename(mission, WRONG)
        run.says("small.mission: 1 error")
        until(lambda: '"state": "wrong"' in news(address), "the bad news")
        assert "unknown name `gaol`" in json.loads(news(address))["says"]
        assert asked(address + "report.html") == first
        save_by_rename(mission, SMALL.replace("drone[2]", "drone[3]"))
        run.says("report: build/small/report.html", 2)
        until(lambda: '"report": 2' in news(address), "the second report")
        assert "3 agents" in run.said
        assert asked(address + "report.html")[1] == (tmp_path / "build/small/report.html").read_text(encoding="utf-8")
        assert run.end(signal.SIGINT) == 130
        assert "Traceback" not in run.said
    assert {path.name for path in (tmp_path / "build").iterdir()} == {"small"}


def test_a_refusal_is_shown_with_its_reasons(tmp_path: Path) -> None:
    (tmp_path / "a.mission").write_text(CONFLICT)
    with watching(tmp_path, "compile", "a.mission", "--watch", "--no-open", "--explain-limit", "0") as run:
        address = run.address()
        until(lambda: '"state": "wrong"' in news(address), "the refusal")
        assert "error[MC609]" in json.loads(news(address))["says"]
        assert asked(address + "report.html")[0] == 404
        assert run.end(signal.SIGINT) == 130


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")
def test_a_newer_save_stops_the_plan_under_way_and_ctrl_c_leaves_nobody_behind(tmp_path: Path) -> None:
    mission = tmp_path / "a.mission"
    mission.write_text(HARD)
    with watching(tmp_path, "compile", "a.mission", "--watch", "--no-open", "-o", "out") as run:
        run.says("Ctrl-C stops")
        until(lambda: any(map(children, children(run.process.pid))), "a solver at work")
        at_work = [each for child in children(run.process.pid) for each in children(child)]
        save_by_rename(mission, SMALL)
        run.says("report: out/report.html")
        until(lambda: not any(map(alive, at_work)), "the end of the solver")
        assert "hard:" not in run.said
        save_by_rename(mission, HARD)
        run.says("saved", 2)
        until(lambda: any(map(children, children(run.process.pid))), "a solver at work again")
        left = children(run.process.pid)
        assert run.end(signal.SIGINT) == 130
        until(lambda: not any(map(alive, left)), "the end of all children")
    assert {path.name for path in tmp_path.iterdir()} == {"a.mission", "out"}


def test_a_folder_that_is_there_is_not_replaced_and_ends_the_watch(tmp_path: Path) -> None:
    (tmp_path / "a.mission").write_text(SMALL)
    (tmp_path / "mine").mkdir()
    with watching(tmp_path, "compile", "a.mission", "--watch", "--no-open", "-o", "mine") as run:
        assert run.process.wait(120) == 1
        run.says("error[MC701]")
    assert list((tmp_path / "mine").iterdir()) == []


def test_a_folder_that_a_stopped_plan_has_written_is_the_watch_s_own_and_another_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.mission").write_text(SMALL)
    orders: list[CompileRequest] = []

    class Listed(Planner):
        def start(self, request: CompileRequest, backend: str) -> None:
            orders.append(request)

    def begun(request: CompileRequest, ours: set[Path]) -> bool:
        _begin(request, Missions(["a.mission"], lambda: [check(request)]), Listed(), LivePage("a.mission"), ours)
        return orders[-1].force

    ours: set[Path] = set()
    begun(CompileRequest(Path("a.mission")), ours)
    Path("build/small").mkdir(parents=True)
    assert begun(CompileRequest(Path("a.mission")), ours)
    Path("mine").mkdir()
    assert not begun(CompileRequest(Path("a.mission"), output=Path("mine")), ours)


# ------------------------------------------------------------------ the page


def news(address: str) -> str:
    """What a page that is opened now is told first."""
    with urllib.request.urlopen(address + "news", timeout=30) as stream:
        return str(stream.readline().decode().removeprefix("data: "))


def test_the_page_is_for_this_machine_and_for_who_means_it() -> None:
    with LivePage("a.mission") as live:
        assert live.address.startswith("http://127.0.0.1:")
        assert asked(live.address)[0] == 200
        assert asked(live.address, "attacker.example")[0] == 403
        assert asked(live.address + "news", "attacker.example:80")[0] == 403


@pytest.mark.parametrize("path", ["plan.json", "../../etc/passwd", "report.html/..", "%2e%2e/setup"])
def test_nothing_but_the_report_is_served(path: str) -> None:
    with LivePage("a.mission") as live:
        live.tell("planned", report=b"<p>report")
        assert asked(live.address + path)[0] == 404
        assert asked(live.address + "report.html?3") == (200, "<p>report")


def test_a_page_that_is_open_hears_of_what_is_new() -> None:
    with LivePage("a.mission") as live, urllib.request.urlopen(live.address + "news", timeout=30) as stream:
        first = json.loads(stream.readline().decode().removeprefix("data: "))
        assert first == {"mission": "a.mission", "state": "checking", "says": "", "report": 0}
        stream.readline()
        live.tell("wrong", "error[MC301]\n")
        second = json.loads(stream.readline().decode().removeprefix("data: "))
        assert (second["state"], second["says"]) == ("wrong", "error[MC301]\n")


def test_check_loads_nothing_that_watches() -> None:
    import subprocess
    import sys

    script = (
        "import sys\nfrom missionc.cli.app import main\nassert main(['check', 'missions/wildfire.mission']) == 0\n"
        "print([name for name in sys.modules if name.startswith(('missionc.cli.watch', 'http', 'multiprocessing'))])"
    )
    root = Path(__file__).resolve().parents[3]
    run = subprocess.run([sys.executable, "-c", script], cwd=root, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"
