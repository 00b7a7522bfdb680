"""The commands: exit statuses, which stream says what, and the JSON documents."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from missionc.cli import exit_status
from missionc.cli.app import main
from missionc.version import __version__
from tests.support.small_missions import CONFLICT, DASH, LATE, SMALL, WRONG, parked

ROOT = Path(__file__).resolve().parents[3]
Captured = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to run commands in, with one mission."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.mission").write_text(SMALL)
    return tmp_path


def write(name: str, text: str) -> str:
    Path(name).write_text(text)
    return name


# --------------------------------------------------------------------- check


def test_check_of_a_clean_mission_ends_with_0(folder: Path, capsys: Captured) -> None:
    assert main(["check", "small.mission"]) == 0
    assert capsys.readouterr() == ("small.mission: no findings\n", "")


def test_check_of_a_wrong_mission_ends_with_1_and_says_so_on_standard_error(folder: Path, capsys: Captured) -> None:
    assert main(["check", write("a.mission", WRONG)]) == 1
    out, err = capsys.readouterr()
    assert out == "a.mission: 1 error\n"
    assert err.startswith("error[MC101]")


def test_check_takes_several_files_and_reports_all(folder: Path, capsys: Captured) -> None:
    assert main(["check", "small.mission", write("a.mission", WRONG), write("b.mission", LATE)]) == 1
    out, err = capsys.readouterr()
    assert out.splitlines() == ["small.mission: no findings", "a.mission: 1 error", "b.mission: 1 error"]
    assert err.index("MC101") < err.index("MC301")


def test_json_of_check_is_one_document_with_the_diagnostics(folder: Path, capsys: Captured) -> None:
    assert main(["check", write("a.mission", LATE), "--format", "json"]) == 1
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert err == ""
    assert document["files"] == [{"file": "a.mission", "ok": False, "places": []}]
    finding = document["diagnostics"][0]
    assert finding["code"] == "MC301"
    assert finding["severity"] == "error"
    assert finding["file"] == "a.mission"
    assert SMALL.splitlines()[finding["line"] - 1].startswith("require visit")


def test_a_parameter_may_be_given_another_value(folder: Path) -> None:
    mission = write(
        "a.mission", SMALL.replace("mission small", "mission small\nparam T = 6 s").replace("6 s] g", "T] g")
    )
    assert main(["check", mission]) == 0
    assert main(["check", mission, "-D", "T=9s"]) == 1
    assert main(["check", mission, "-D", "T=4 s"]) == 0


def test_a_parameter_nobody_declared_is_an_error_of_the_mission(folder: Path, capsys: Captured) -> None:
    assert main(["check", "small.mission", "-D", "TT=9s"]) == 1
    assert "MC106" in capsys.readouterr().err


def test_a_limit_can_be_lowered_and_raised(folder: Path, capsys: Captured) -> None:
    assert main(["check", "small.mission", "--limit", "agents=1"]) == 1
    assert "MC513" in capsys.readouterr().err
    assert main(["check", "small.mission", "--limit", "agents=2"]) == 0


# --------------------------------------------------------- the command line


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["check", "absent.mission"], "there is no file `absent.mission`"),
        (["check", "."], "`.` is a folder"),
        (["check"], "FILE"),
        (["chekc", "small.mission"], "chekc"),
        (["check", "small.mission", "-D", "T"], "`T` is not a pair; write NAME=VALUE"),
        (["check", "small.mission", "--limit", "agnets=3"], "did you mean `agents`?"),
        (["check", "small.mission", "--limit", "agents=many"], "is not a number: `many`"),
        (["check", "small.mission", "--limit", "agents=0"], "write a number above 0"),
        (["compile", "small.mission", "--emit", "asm"], "unknown stage `asm`"),
        (["compile", "small.mission", "--memory-limit", "lots"], "`lots` is not a memory size"),
        (["compile", "small.mission", "--time-limit", "0"], "--time-limit"),
        (["compile", "small.mission", "--plot", "a.gif"], "end the name with one of .svg, .png, .pdf"),
        (["explain", "MC999"], "unknown code `MC999`"),
    ],
)
def test_a_wrong_command_line_ends_with_2_and_one_reason(
    folder: Path, capsys: Captured, words: list[str], says: str
) -> None:
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err


def test_the_version_is_said(capsys: Captured) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"missionc {__version__}\n"


def test_help_names_the_commands(capsys: Captured) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(command in out for command in ("check", "compile", "monitor", "explain"))


def test_explain_prints_the_page_whichever_way_the_code_is_written(capsys: Captured) -> None:
    page = (ROOT / "docs" / "errors" / "MC301.md").read_text()
    for code in ("MC301", "mc301", "301"):
        assert main(["explain", code]) == 0
        assert capsys.readouterr().out == page


def test_explain_without_a_code_lists_them(capsys: Captured) -> None:
    assert main(["explain"]) == 0
    assert "MC301  the mission ends too early\n" in capsys.readouterr().out


def test_completion_is_offered_for_bash() -> None:
    environment = {
        **os.environ,
        "_MISSIONC_COMPLETE": "bash_complete",
        "COMP_WORDS": "missionc comp",
        "COMP_CWORD": "1",
    }
    run = subprocess.run([sys.executable, "-m", "missionc"], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert run.stdout == "plain,compile\n"


@pytest.mark.parametrize("form", ["text", "json"])
def test_a_terminal_that_lacks_letters_and_a_file_name_in_no_encoding_stop_no_message(folder: Path, form: str) -> None:
    name = os.fsencode(folder) + b"/\xff\xe4.mission"
    Path(os.fsdecode(name)).write_text(WRONG)
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "missionc", "check", name, "--format", form]
    run = subprocess.run(command, env=environment, capture_output=True)
    assert run.returncode == 1
    assert b"MC101" in run.stdout + run.stderr
    assert b"Traceback" not in run.stderr


# ------------------------------------------------------------------- compile


def test_compile_writes_the_folder_and_says_where(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert re.match(r"small: verified in [0-9.]+ s: 2 agents for 6 s, planned by smt, seed 0\n", out)
    assert len(out.splitlines()) <= 5
    assert "visit  satisfied" not in out
    assert f"report: {Path('build') / 'small' / 'report.html'}" in out
    names = {path.relative_to(folder / "build/small").as_posix() for path in (folder / "build/small").rglob("*.*")}
    assert names == {
        "plan.json",
        "trajectories.csv",
        "certificate.json",
        "report.html",
        "manifest.json",
        "mission/small.mission",
        "crazyflie/drone0.csv",
        "crazyflie/drone1.csv",
    }


def test_json_of_compile_holds_the_outcome(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "-o", "out", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["outcome"] == "planned"
    assert document["output"] == "out"
    assert document["backend"] == "smt"
    assert document["diagnostics"] == []
    assert [(each["name"], each["satisfied"]) for each in document["requirements"]] == [("visit", True)]
    assert {"parse", "resolve", "verify", "emit"} <= set(document["timings"])


def test_the_same_seed_gives_the_same_bytes(folder: Path) -> None:
    for name in ("one", "two"):
        assert main(["compile", "small.mission", "-o", name, "--seed", "3", "--quiet"]) == 0
    one = {path.relative_to("one"): path.read_bytes() for path in Path("one").rglob("*.*")}
    two = {path.relative_to("two"): path.read_bytes() for path in Path("two").rglob("*.*")}
    assert one == two


def test_an_impossible_mission_ends_with_6_and_names_the_conflict(folder: Path, capsys: Captured) -> None:
    assert main(["compile", write("a.mission", CONFLICT), "--format", "json", "--explain-limit", "0"]) == 6
    document = json.loads(capsys.readouterr().out)
    assert document["outcome"] == "impossible"
    assert (document["conflict"], document["scope"]) == (["visit", "guard", "link"], "mission")
    assert document["diagnostics"][0]["code"] == "MC609"
    assert (document["blame"], document["relaxations"], document["near_miss"]) == (None, [], None)
    assert not Path("build").exists()


def test_a_mission_that_only_sampled_roadmaps_refuse_ends_with_4(folder: Path, capsys: Captured) -> None:
    assert main(["compile", write("a.mission", DASH), "--format", "json", "--explain-limit", "0"]) == 4
    document = json.loads(capsys.readouterr().out)
    assert (document["outcome"], document["conflict"], document["scope"]) == ("undecided", ["reach"], "roadmaps")
    (finding,) = document["diagnostics"]
    assert finding["code"] == "MC601"
    assert any("does not exclude other motions" in note for note in finding["notes"])


def test_a_time_limit_that_comes_first_ends_with_4(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "--time-limit", "0.000001", "--format", "json"]) == 4
    document = json.loads(capsys.readouterr().out)
    assert document["outcome"] == "undecided"
    assert document["diagnostics"][0]["code"] == "MC602"
    assert not Path("build").exists()


def test_a_wrong_mission_is_not_compiled(folder: Path, capsys: Captured) -> None:
    assert main(["compile", write("a.mission", WRONG), "--format", "json"]) == 1
    assert json.loads(capsys.readouterr().out)["outcome"] == "refused"
    assert not Path("build").exists()


def test_a_plan_that_fails_verification_ends_with_5_and_is_not_written(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    from missionc.backends.api import Planned, Turns
    from missionc.backends.smt.backend import BACKEND

    turns = type(BACKEND).turns

    def planned_badly(self: object, *arguments: object) -> Turns:
        found = yield from turns(self, *arguments)  # type: ignore[arg-type]
        assert isinstance(found, Planned)
        found.trace.position[0, 3] += 1.0
        return found

    monkeypatch.setattr(type(BACKEND), "turns", planned_badly)
    assert main(["compile", "small.mission", "--format", "json"]) == 5
    document = json.loads(capsys.readouterr().out)
    assert document["outcome"] == "unverified"
    assert document["diagnostics"][0]["code"] == "MC604"
    assert not Path("build").exists()


@pytest.mark.parametrize("backend", ["clot", "hybrid"])
def test_a_preset_without_torch_says_how_to_install_it(
    backend: str, folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missionc.backends.load.find_spec", lambda name: None)
    assert main(["compile", "small.mission", "--backend", backend, "--preset", "search", "-o", "out"]) == 1
    said = capsys.readouterr().err
    assert "`--preset search` needs the package torch" in said
    assert "pip install 'missionc[clot]'" in said
    assert not (folder / "out").exists()


def test_an_existing_folder_is_kept_without_force_and_replaced_with_it(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "-o", "out", "--quiet"]) == 0
    before = (folder / "out" / "plan.json").read_bytes()
    assert main(["compile", "small.mission", "-o", "out", "--quiet", "--seed", "4"]) == 1
    assert "MC701" in capsys.readouterr().err
    assert (folder / "out" / "plan.json").read_bytes() == before
    assert main(["compile", "small.mission", "-o", "out", "--quiet", "--seed", "4", "--force"]) == 0
    assert (folder / "out" / "plan.json").read_bytes() != before


@pytest.mark.parametrize("name", [os.fsdecode(b"\xff.mission"), "a\\b.mission"])
def test_a_mission_with_a_strange_name_is_compiled_and_its_folder_verified(folder: Path, name: str) -> None:
    (folder / name).write_bytes((folder / "small.mission").read_bytes())
    for force in ([], ["--force"]):
        assert main(["compile", name, "-o", "out", "--quiet", *force]) == 0
    assert main(["verify", "out"]) == 0


def test_force_does_not_replace_what_the_compiler_did_not_write(folder: Path, capsys: Captured) -> None:
    (folder / "out").mkdir()
    (folder / "out" / "thesis.tex").write_text("years of work")
    assert main(["compile", "small.mission", "-o", "out", "--quiet", "--force"]) == 1
    assert "MC701" in capsys.readouterr().err
    assert (folder / "out" / "thesis.tex").read_text() == "years of work"


def test_quiet_prints_nothing_when_all_is_well(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_timings_name_every_stage(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "--timings", "--quiet"]) == 0
    out = capsys.readouterr().out
    assert all(stage in out for stage in ("parse", "resolve", "expand", "verify", "emit"))


@pytest.mark.parametrize("stage", ["ast", "ir", "kernel", "cost-graph", "horizons", "backend", "strategy"])
def test_a_stage_before_planning_is_printed_and_nothing_written(folder: Path, capsys: Captured, stage: str) -> None:
    assert main(["compile", "small.mission", "--emit", stage]) == 0
    out, err = capsys.readouterr()
    assert out.strip()
    assert err == ""
    assert not Path("build").exists()


def test_stages_are_printed_in_the_order_of_the_pipeline(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "--emit", "kernel,ast", "--emit", "ir"]) == 0
    headings = [line for line in capsys.readouterr().out.splitlines() if line.startswith("# ")]
    assert headings == ["# ast", "# ir", "# kernel"]


def test_the_clauses_and_the_plan_can_be_printed(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "--emit", "dimacs,plan", "--format", "json"]) == 0
    emitted = json.loads(capsys.readouterr().out)["emit"]
    assert "\np cnf " in "\n" + emitted["dimacs"]
    assert json.loads(emitted["plan"])["mission"] == "small"
    assert not Path("build").exists()


def test_a_plot_is_drawn(folder: Path) -> None:
    pytest.importorskip("matplotlib")
    assert main(["compile", "small.mission", "--quiet", "--plot", "pictures/small.svg"]) == 0
    assert "<svg" in Path("pictures/small.svg").read_text()


def test_a_plot_that_cannot_be_drawn_is_refused_before_planning(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missionc.output.plot.plot.find_spec", lambda name: None)
    assert main(["compile", "small.mission", "--quiet", "--plot", "small.svg"]) == 1
    assert capsys.readouterr().err.startswith("error[MC404]")
    assert not Path("build").exists()


def test_a_proof_is_left_beside_an_impossible(folder: Path) -> None:
    pytest.importorskip("pysat")
    assert (
        main(["compile", write("a.mission", CONFLICT), "-o", "out", "--certify", "--explain-limit", "0", "--quiet"])
        == 6
    )
    assert {path.suffix for path in Path("out").iterdir()} >= {".cnf", ".drat"}


# ------------------------------------------------------------------- monitor


def test_a_trace_that_violates_ends_with_3_and_names_the_requirement(folder: Path, capsys: Captured) -> None:
    assert main(["monitor", "small.mission", write("a.csv", parked())]) == 3
    out = capsys.readouterr().out
    assert out.startswith("small: violated\n  visit  violated")


def test_a_plan_just_written_satisfies_its_mission(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "small.mission", "--quiet", "-o", "out"]) == 0
    for trace in ("out/plan.json", "out/trajectories.csv"):
        assert main(["monitor", "small.mission", trace, "--format", "json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document["satisfied"] is True
        assert document["requirements"][0]["robustness"] > 0


def test_a_trace_that_does_not_fit_ends_with_1(folder: Path, capsys: Captured) -> None:
    assert main(["monitor", "small.mission", write("a.csv", parked(steps=3))]) == 1
    assert "MC705" in capsys.readouterr().err
    assert main(["monitor", "small.mission", write("a.csv", "agent;t\n")]) == 1
    assert "MC704" in capsys.readouterr().err


def test_monitor_needs_no_backend(tmp_path: Path, capsys: Captured) -> None:
    mission = tmp_path / "a.mission"
    mission.write_text(SMALL + "minimize energy\nprefer slow: every drone: always[0, 6 s] speed <= 1 m/s\n")
    (tmp_path / "a.csv").write_text(parked())
    assert main(["monitor", str(mission), str(tmp_path / "a.csv"), "--format", "json"]) == 3
    assert json.loads(capsys.readouterr().out)["preferences"][0]["satisfied"] is True


UNREACHABLE = """mission slow
time  step 1 s, horizon 3 s
world (0, 0) to (10, 10)
region goal = box (8, 0) to (9, 2)
agent cart { radius 0.2 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1) }
require wait: (cart: goal) until[0, end] (cart: x <= 8)
"""


@pytest.mark.parametrize(("places", "status"), [((1, 1, 1, 1), 0), ((8.5, 9.5, 9.5, 9.5), 3)])
def test_recorded_and_live_judge_alike_what_no_planner_can_plan(
    places: tuple[float, ...], status: int, folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = UNREACHABLE.replace("start at (1, 1)", "start at (20, 1)")
    mission, told = write("slow.mission", text), list(enumerate(places))
    trace = write("flown.csv", "agent,t,x,y\n" + "".join(f"cart,{t},{x},1\n" for t, x in told))
    lines = "".join(json.dumps({"t": t, "agent": "cart", "position": [x, 1]}) + "\n" for t, x in told)
    for words in ([trace], [trace, "--format", "json"], ["--live"], ["--live", "--format", "json"]):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(lines.encode())))
        assert main(["monitor", mission, *words]) == status
        streams = capsys.readouterr()
        if "json" in words:
            assert '"code": "MC501", "severity": "warning"' in " ".join(streams.out.split())
        else:
            assert "warning[MC501]" in streams.err


def test_a_trace_along_a_border_ends_with_4(folder: Path, capsys: Captured) -> None:
    mission = write(
        "edge.mission",
        UNREACHABLE.replace("(cart: goal) until[0, end] (cart: x", "cart: always[0, end] (x").replace(
            "(1, 1)", "(8, 1)"
        ),
    )
    trace = write("edge.csv", "agent,t,x,y\ncart,0,8,1\ncart,1,8,2\ncart,2,8,1\ncart,3,8,1\n")
    assert main(["monitor", mission, trace]) == 0
    capsys.readouterr()
    assert main(["monitor", mission, trace, "--continuous"]) == 4
    assert capsys.readouterr().out.startswith("slow: not decided\n  wait  satisfied")
    assert main(["monitor", mission, trace, "--continuous", "--format", "json"]) == 4
    assert json.loads(capsys.readouterr().out)["satisfied"] is None


# --------------------------------------------------- defects, colours, signals


def test_a_defect_is_one_message_without_a_traceback(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: object, **named: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.delenv("MISSIONC_TRACEBACK", raising=False)
    monkeypatch.setattr("missionc.cli.commands.check.check", broken)
    assert main(["check", "small.mission"]) == 70
    err = capsys.readouterr().err
    assert err.startswith("error[MC901]: internal error: ZeroDivisionError at test_cli.py:")
    assert "Traceback" not in err
    assert main(["check", "small.mission", "--format", "json"]) == 70
    assert json.loads(capsys.readouterr().out)["diagnostics"][0]["code"] == "MC901"


def test_a_defect_shows_its_traceback_to_who_asks(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object, **named: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setenv("MISSIONC_TRACEBACK", "1")
    monkeypatch.setattr("missionc.cli.commands.check.check", broken)
    with pytest.raises(ZeroDivisionError):
        main(["check", "small.mission"])


@pytest.mark.parametrize(
    ("terminal", "environment", "coloured"),
    [(True, {}, True), (False, {}, False), (True, {"NO_COLOR": "1"}, False), (True, {"TERM": "dumb"}, False)],
)
def test_colours_are_for_terminals_and_those_who_want_them(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, environment: dict[str, str], coloured: bool
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert exit_status.in_colour(terminal) is coloured
