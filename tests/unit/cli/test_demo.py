"""``missionc demo``: a stranger sees a report, and nothing of theirs is touched."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from missionc.base.resources import folder
from missionc.cli.app import main
from missionc.cli.browser import SCREENS, opened
from missionc.cli.commands.demo import MISSION
from tests.support.small_missions import SMALL

ROOT = Path(__file__).resolve().parents[3]
Captured = pytest.CaptureFixture[str]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("BROWSER", *SCREENS):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.fixture
def small_demo(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The demo of a mission that is planned at once, for what it does with the folder and the browser."""
    (here / "missions").mkdir()
    (here / "missions" / f"{MISSION}.mission").write_text(SMALL)
    monkeypatch.setattr("missionc.cli.commands.demo.folder", lambda name: here / name)


def test_the_demo_plans_without_a_mission_and_says_where_its_report_is(here: Path, capsys: Captured) -> None:
    assert main(["demo", "--no-open"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert re.match(r"wildfire: verified in [0-9.]+ s: 5 agents for 20 s, planned by smt", out)
    report = Path("missionc-demo") / "report.html"
    assert f"report: {report}\n" in out
    assert "<title>wildfire" in report.read_text(encoding="utf-8")
    mission = Path("missionc-demo/mission/wildfire.mission")
    assert out.endswith(f"mission file to copy and edit: {mission}\n")
    assert mission.read_bytes() == (ROOT / "missions" / "wildfire.mission").read_bytes()


@pytest.mark.usefixtures("small_demo")
def test_the_demo_leaves_what_is_there_alone(here: Path, capsys: Captured) -> None:
    (here / "missionc-demo").mkdir()
    (here / "missionc-demo-2").write_text("mine")
    assert main(["demo", "--no-open"]) == 0
    assert "report: missionc-demo-3/report.html" in capsys.readouterr().out.replace(os.sep, "/")
    assert list((here / "missionc-demo").iterdir()) == []
    assert (here / "missionc-demo-2").read_text() == "mine"


def test_a_folder_that_is_named_and_exists_is_refused(here: Path, capsys: Captured) -> None:
    (here / "mine").mkdir()
    assert main(["demo", "--no-open", "-o", "mine"]) == 1
    out, err = capsys.readouterr()
    assert "MC701" in err
    assert out == ""


@pytest.mark.usefixtures("small_demo")
def test_without_a_screen_no_browser_is_asked_and_the_user_is_told(here: Path, capsys: Captured) -> None:
    assert main(["demo", "-o", "shown"]) == 0
    out = capsys.readouterr().out
    assert "report (no browser found; open it yourself): shown/report.html" in out.replace(os.sep, "/")


def test_the_report_is_opened_in_the_user_s_browser(
    here: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser = here / "browser.py"
    browser.write_text("import sys, pathlib\npathlib.Path('asked').write_text(sys.argv[1])\n")
    monkeypatch.setenv("BROWSER", f"{sys.executable} {browser} %s")
    # The standard library reads BROWSER once; nobody has asked it for a browser yet in a process of its own.
    command = [sys.executable, "-m", "missionc", "demo"]
    run = subprocess.run(command, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "report (opened in the browser): missionc-demo" in run.stdout
    assert (here / "asked").read_text() == (here / "missionc-demo" / "report.html").as_uri()


def test_a_browser_that_cannot_be_started_is_no_error(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BROWSER", "/does/not/exist")
    assert not opened("file:///nowhere.html")


def test_the_demo_needs_no_torch(here: Path) -> None:
    script = (
        "import sys\nsys.modules['torch'] = None\nfrom missionc.cli.app import main\nprint(main(['demo', '--no-open']))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "0"


def test_the_demo_s_mission_comes_with_the_package() -> None:
    assert (folder("missions") / "wildfire.mission").is_file()
