"""Sweeps: which runs there are, what is kept of them whenever it ends, and what is made of them."""

from __future__ import annotations

import csv
import io
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Timer

import pytest

from missionc.backends.options import Options
from missionc.base.diagnostics.code import (
    CANNOT_WRITE,
    NOT_COMPARABLE,
    NOT_TO_BE_LOST,
    OTHER_SWEEP,
    OTHER_VERSIONS,
    OUTPUT_EXISTS,
    SWEEP_AT_WORK,
    SWEEP_UNREADABLE,
    SWEPT_VALUES,
    UNKNOWN_PARAMETER,
)
from missionc.base.diagnostics.model import Diagnostic
from missionc.cli.app import main
from missionc.tools.sweep import run_answer, run_request
from missionc.tools.sweep.append_journal import Journal
from missionc.tools.sweep.carry_out_sweep import RemainingTime
from missionc.tools.sweep.results_table import OF_THE_MACHINE, Comparison, Table, compare_sweeps, groups
from missionc.tools.sweep.run_answer import OUTCOMES, RunResult
from missionc.tools.sweep.run_grid import Grid, Run, Varied, read_varied
from missionc.tools.sweep.run_request import Flights, Request, Settings
from missionc.tools.sweep.run_sweep import RunProcesses
from missionc.tools.sweep.sweep_folder import JOURNAL, SCHEMA, SWEEP, Row, SweepFolder, at_work, begin, read_sweep
from tests.support.small_missions import CONFLICT, SMALL

MANY = (
    SMALL.replace("mission small", "mission small\nparam N = 2\nparam R = 0.1 m", 1)
    .replace("drone[2]", "drone[N]")
    .replace("radius   0.1 m", "radius   R")
)
ABOUT = {"mission": "small", "varied": {"N": ["1", "2"]}, "seeds": 2, "options": {"margin": None}}
ONE = Run((("N", "1"),), 0)


def row(run: Run = ONE, outcome: str = "planned", **values: float) -> Row:
    return Row(run, RunResult(outcome, values, {"nodes": 40}), "here")


def rows_of(seconds: list[float], outcome: str = "planned") -> dict[Run, Row]:
    """A run for each seed."""
    runs = [Run(ONE.values, seed) for seed in range(len(seconds))]
    return {run: row(run, outcome, seconds=each, length=2 * each) for run, each in zip(runs, seconds, strict=True)}


# ---------------------------------------------------------------- values


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("3,5,8,10", ("3", "5", "8", "10")),
        ("1..2/0.25", ("1", "1.25", "1.5", "1.75", "2")),
        ("3..6", ("3", "4", "5", "6")),
        ("0.1..0.3/0.1 m", ("0.1 m", "0.2 m", "0.3 m")),
        ("-1..1, 5 s", ("-1", "0", "1", "5 s")),
        ("0.50..1.00/0.50", ("0.5", "1")),
        ("(1 m)", ("(1 m)",)),
    ],
)
def test_values_are_a_list_or_a_range(text: str, values: tuple[str, ...]) -> None:
    assert read_varied([("N", text)], []) == (Varied("N", values),)


def test_values_that_cannot_be_meant_are_refused(subtests: pytest.Subtests) -> None:
    for text in [
        "",
        "1,,2",
        "2..1",
        "1..2/0",
        "1..2/0.3",
        "1..2/-1",
        "1..",
        "1..2..3",
        "1..1e9",
        "1,2,1",
        "1..9999999",
        "..",
        "1 m,1m",
    ]:
        with subtests.test(text=text):
            wrong = read_varied([("N", text)], [])
            assert isinstance(wrong, list)
            assert {each.code for each in wrong} == {SWEPT_VALUES}


def test_a_parameter_is_varied_once_and_has_no_other_value() -> None:
    wrong = read_varied([("N", "1,2"), ("N", "3"), ("R", "1")], ["R"])
    assert isinstance(wrong, list)
    assert len(wrong) == 2


def test_the_grid_has_every_combination_with_every_seed() -> None:
    grid = Grid((Varied("N", ("1", "2")), Varied("R", ("0.1 m", "(0.2 m)"))), 3)
    runs = list(grid.runs())
    assert len(runs) == len(grid) == len(set(runs)) == 12
    assert runs[:4] == [
        *(Run((("N", "1"), ("R", "0.1 m")), seed) for seed in range(3)),
        Run((("N", "1"), ("R", "(0.2 m)")), 0),
    ]
    assert runs[0].name == "N=1_R=0.1m_seed=0"
    assert len({run.name for run in runs}) == 12
    assert all(set(run.name) <= set("abcdefghijklmnopqrstuvwxyzNR0123456789._=-") for run in runs)


# ---------------------------------------------------------------- what goes over the wire


def test_a_request_and_an_answer_are_texts_that_read_back_the_same() -> None:
    flights = Flights(3, {"wind": 0.5}, (("drone[0]", 2.0),))
    settings = Settings({"a.mission": b"\xff\n"}, {"T": "3 s"}, options=Options(margin=0.1), flights=flights, keep=True)
    request = Request(settings, {"N": "3"}, 7, ("smt",))
    text = run_request.run_request_text(request)
    assert "\n" not in text
    assert text.isascii()
    assert run_request.read_run_request(text) == request
    result = RunResult("planned", {"seconds": 1.5, "says": "ä\n"}, {"nodes": 3}, (("plan.json", b"\x00"),))
    answer = run_answer.read_run_answer(run_answer.with_usage(run_answer.run_answer_text(result), 2.0, 1 << 20))
    assert answer.result.files == result.files
    assert answer.result.values == {**result.values, "cpu_seconds": 2.0, "peak_bytes": 1 << 20}


@pytest.fixture(scope="module")
def processes() -> Iterator[RunProcesses]:
    found = RunProcesses()
    yield found
    found.end()


def answered(processes: RunProcesses, settings: Settings, seed: int = 0) -> run_answer.Answer:
    return run_answer.read_run_answer(processes.answer_to(run_request.run_request_text(Request(settings, {}, seed))))


def test_every_outcome_is_told_from_the_others(processes: RunProcesses) -> None:
    small = Settings({"small.mission": SMALL.encode()}, flights=Flights(1))
    planned = answered(processes, small).result
    assert planned.outcome == "planned"
    assert planned.values["flights"] == planned.values["flights_kept"] == 1
    again = answered(processes, small).result
    assert again.values["plan"] == planned.values["plan"]
    assert answered(processes, replace(small, files={"a.mission": CONFLICT.encode()})).result.outcome == "impossible"
    assert answered(processes, replace(small, files={"a.mission": b"mission a"})).result.outcome == "refused"
    assert answered(processes, replace(small, time_limit=1e-9)).result.outcome == "undecided"
    other = answered(processes, replace(small, versions={"missionc": "0"}))
    assert other.versions["missionc"] != "0"
    assert "cannot be read" in str(run_answer.read_run_answer(processes.answer_to("{}")).result.values["says"])


def test_a_run_that_is_killed_is_an_error_and_one_whose_process_dies_is_done_by_another(
    processes: RunProcesses,
) -> None:
    small = Settings({"small.mission": SMALL.encode()})
    endless = SMALL.replace("horizon 6 s", "horizon 600 s").replace("nodes = 40", "nodes = 4000")
    (own,) = processes._all
    server = own._process.pid
    killer = Timer(0.5, lambda: [os.kill(child, signal.SIGKILL) for child in children(server)])
    killer.start()
    killed = answered(processes, Settings({"a.mission": endless.encode()})).result
    assert killed.outcome == "error"
    assert "signal 9" in str(killed.values["says"])
    os.kill(server, signal.SIGKILL)
    assert answered(processes, small).result.outcome == "planned"


def children(process: int) -> list[int]:
    return list(map(int, Path(f"/proc/{process}/task/{process}/children").read_text().split()))


# ---------------------------------------------------------------- the folder


def test_the_journal_is_read_up_to_its_last_whole_line_wherever_it_is_cut(tmp_path: Path) -> None:
    assert begin(tmp_path / "out", ABOUT, {"a.mission": b"mission a"}) is None
    found = [row(Run((("N", "1"),), seed), seconds=float(seed)) for seed in range(3)]
    with at_work(tmp_path / "out") as journal:
        assert isinstance(journal, Journal)
        for each in found:
            journal.add(each.as_line())
    whole = (tmp_path / "out" / JOURNAL).read_bytes()
    for length in random.Random(0).sample(range(len(whole) + 1), 40):
        (tmp_path / "out" / JOURNAL).write_bytes(whole[:length])
        read = read_sweep(tmp_path / "out")
        assert isinstance(read, SweepFolder)
        assert list(read.rows.values()) == found[: whole[:length].count(b"\n")]
        with at_work(tmp_path / "out") as journal:
            assert isinstance(journal, Journal)
            journal.add(row(Run((("N", "2"),), 0)).as_line())
        again = read_sweep(tmp_path / "out")
        assert isinstance(again, SweepFolder)
        assert len(again.rows) == len(read.rows) + 1


def test_a_folder_has_one_sweep_which_may_grow(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert begin(out, ABOUT, {}) is None
    assert begin(out, ABOUT, {}) is None
    assert begin(out, {**ABOUT, "varied": {"N": ["1", "2", "3"]}, "seeds": 3}, {}) is None
    for other in (
        {**ABOUT, "mission": "other"},
        {**ABOUT, "varied": {"N": ["1", "3"]}, "seeds": 3},
        {**ABOUT, "varied": {"M": ["1"]}, "seeds": 3},
        {**ABOUT, "varied": {"N": ["1", "2", "3"]}, "seeds": 1},
        {**ABOUT, "options": {"margin": 1.0}},
    ):
        wrong = begin(out, other, {})
        assert isinstance(wrong, Diagnostic)
        assert wrong.code is OTHER_SWEEP
        assert wrong.notes


def test_a_folder_that_was_only_begun_is_begun_again(tmp_path: Path) -> None:
    files = {"a.mission": b"mission a", "maps/b.mission": b"mission b"}
    for left in ([], [".missionc-0123456789abcdef"], ["sweep.json"], ["sweep.json", "mission/a.mission"]):
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        assert begin(tmp_path / "out", ABOUT, files) is None
        for path in sorted((tmp_path / "out").rglob("*"), reverse=True):
            name = path.relative_to(tmp_path / "out").as_posix()
            if not any(name == each or each.startswith(f"{name}/") for each in left):
                path.rmdir() if path.is_dir() else path.unlink()
        if left[:1] == [".missionc-0123456789abcdef"]:
            (tmp_path / "out" / left[0]).mkdir()
        assert begin(tmp_path / "out", ABOUT, files) is None
        assert (tmp_path / "out" / "mission" / "maps" / "b.mission").read_bytes() == b"mission b"
        assert isinstance(read_sweep(tmp_path / "out"), SweepFolder)


@pytest.mark.parametrize("target", ["sweep.json", "mission/maps/b.mission", "plans/N=1"])
def test_what_a_killed_process_left_in_the_folder_of_a_sweep_is_cleared_away(target: str, tmp_path: Path) -> None:
    files = {"a.mission": b"mission a", "maps/b.mission": b"mission b"}
    assert begin(tmp_path, ABOUT, files) is None
    staged = (tmp_path / target).parent / ".missionc-0123456789abcdef"
    staged.mkdir(parents=True)
    marker = {"schema": "missionc.staging/1", "token": "0123456789abcdef", "target": Path(target).name}
    (staged / "staging.json").write_text(json.dumps(marker))
    assert begin(tmp_path, ABOUT, files) is None
    assert not staged.exists()


def test_a_folder_of_something_else_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    wrong = begin(tmp_path, ABOUT, {})
    assert wrong is not None
    assert wrong.code is OUTPUT_EXISTS
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    "line",
    ["{}", "no", "[]", '{"values":{"N":1},"seed":0,"outcome":"planned"}', '{"values":{},"seed":0,"outcome":"fine"}'],
)
def test_a_journal_that_somebody_wrote_in_is_refused_with_its_line(tmp_path: Path, line: str) -> None:
    begin(tmp_path, ABOUT, {})
    (tmp_path / JOURNAL).write_text(f"{line}\n")
    wrong = read_sweep(tmp_path)
    assert isinstance(wrong, Diagnostic)
    assert wrong.code is SWEEP_UNREADABLE
    assert "line 1" in wrong.notes[0]


@pytest.mark.parametrize("about", [{"varied": 5}, {"varied": {"N": 5}}, {"seeds": "2"}, {"seeds": None}])
def test_a_sweep_that_does_not_say_what_it_is_of_is_refused(about: dict[str, object], tmp_path: Path) -> None:
    (tmp_path / SWEEP).write_text(json.dumps({"schema": SCHEMA, **ABOUT, **about}))
    for wrong in (read_sweep(tmp_path), begin(tmp_path, ABOUT, {})):
        assert isinstance(wrong, Diagnostic)
        assert wrong.code is SWEEP_UNREADABLE


@pytest.mark.parametrize("name", [SWEEP, JOURNAL])
def test_a_pipe_in_the_place_of_a_file_of_a_sweep_is_refused_and_not_waited_for(name: str, tmp_path: Path) -> None:
    begin(tmp_path, ABOUT, {})
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    wrong = read_sweep(tmp_path)
    assert isinstance(wrong, Diagnostic)
    assert wrong.code is SWEEP_UNREADABLE
    assert "not a regular file" in wrong.notes[0]
    if name == JOURNAL:
        with at_work(tmp_path) as journal:
            assert isinstance(journal, Diagnostic)
            assert journal.code is CANNOT_WRITE


@pytest.mark.parametrize("name", [SWEEP, "mission/a.mission", "mission"])
def test_a_sweep_does_not_write_through_a_link_in_its_folder(name: str, tmp_path: Path) -> None:
    out, mine = tmp_path / "out", tmp_path / "mine"
    (mine / "a").mkdir(parents=True)
    (mine / "file").write_text("mine")
    assert begin(out, ABOUT, {}) is None
    (out / name).parent.mkdir(exist_ok=True)
    (out / name).unlink(missing_ok=True)
    (out / name).symlink_to(mine if name == "mission" else mine / "file")
    if name == SWEEP:
        (mine / "file").write_text(json.dumps({"schema": SCHEMA, **ABOUT}))
    before = (mine / "file").read_text()
    wrong = begin(out, {**ABOUT, "seeds": 7}, {"a.mission": b"mission a"})
    assert wrong is not None
    assert wrong.code is CANNOT_WRITE
    assert (mine / "file").read_text() == before
    assert sorted(path.name for path in mine.iterdir()) == ["a", "file"]


def test_one_command_is_at_work_in_a_folder(tmp_path: Path) -> None:
    begin(tmp_path, ABOUT, {})
    with at_work(tmp_path) as first, at_work(tmp_path) as second:
        assert isinstance(first, Journal)
        assert isinstance(second, Diagnostic)
        assert second.code is SWEEP_AT_WORK


# ---------------------------------------------------------------- what is made of the rows


def test_the_table_has_numbers_as_numbers_and_nothing_where_there_is_nothing() -> None:
    runs = [Run((("N", "1"), ("R", "0.5 m"), ("seed", "x")), 0), Run((("N", "2"), ("R", "1 m"), ("seed", "y")), 1)]
    table = Table(["N", "R", "seed"], [row(runs[0], seconds=1.5), row(runs[1], "impossible")])
    read = list(csv.DictReader(io.StringIO(table.csv().decode())))
    assert [each["N"] for each in read] == ["1.0", "2.0"]
    assert [each["R [m]"] for each in read] == ["0.5", "1.0"]
    assert [each["param_seed"] for each in read] == ["x", "y"]
    assert [each["seconds"] for each in read] == ["1.5", ""]
    assert [each["size_nodes"] for each in read] == ["40", "40"]
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    typed = parquet.read_table(io.BytesIO(table.parquet()))
    assert typed.to_pylist() == table.rows
    assert str(typed.schema.field("seconds").type) == "double"


def test_statistics_are_those_of_a_combination() -> None:
    rows = rows_of([1.0, 2.0, 3.0, 4.0])
    rows |= {
        Run(ONE.values, 4): row(Run(ONE.values, 4), "impossible"),
        Run(ONE.values, 5): row(Run(ONE.values, 5), "error"),
    }
    (group,) = groups([ONE.values], rows)
    assert group.success is not None
    assert (group.success.held, group.success.flights) == (4, 5)
    assert (group.spreads["seconds"].low, group.spreads["seconds"].median, group.spreads["seconds"].high) == (
        1.75,
        2.5,
        3.25,
    )
    assert set(group.outcomes) == set(OUTCOMES)


def test_what_is_left_is_an_interval_that_holds_what_it_takes() -> None:
    known = RemainingTime({ONE.values: 100}, rows_of([1.0]))
    assert known.left(1) is None
    known = RemainingTime({ONE.values: 100}, rows_of([0.5, 1.0, 1.5] * 10))
    left = known.left(2)
    assert left is not None
    assert left[0] < 50 < left[1]
    for seed in range(100):
        known.over(row(Run(ONE.values, seed), seconds=1.0))
    assert known.left(2) == (0.0, 0.0)


def compared(old: dict[Run, Row], new: dict[Run, Row]) -> dict[str, Comparison]:
    found = compare_sweeps(SweepFolder(Path("old"), {}, old), new)
    assert isinstance(found, list)
    return {each.measure.name: each for each in found if each.values is None}


def test_a_change_is_told_from_noise() -> None:
    draw = random.Random(1)
    old = [1 + draw.random() for _ in range(30)]
    noise = compared(rows_of(old), rows_of([each + draw.gauss(0, 0.1) for each in old]))
    assert noise["seconds"].verdict == "noise"
    assert noise["planned"].verdict == "the same"
    quicker = compared(rows_of(old), rows_of([0.8 * each for each in old]))
    assert quicker["seconds"].verdict == "better"
    assert quicker["length"].verdict == "better"
    lost = compared(rows_of(old), {**rows_of(old), **rows_of(old[:10], "undecided")})
    assert lost["planned"].verdict == "worse"
    few = compared(rows_of(old[:3]), rows_of([2 * each for each in old[:3]]))
    assert few["seconds"].verdict == "too few pairs for a verdict"
    assert compared(rows_of(old), rows_of(old))["seconds"].verdict == "the same"


def test_the_tests_are_those_of_scipy_with_holms_correction() -> None:
    stats = pytest.importorskip("scipy.stats")
    draw = random.Random(2)
    old = [1 + draw.random() for _ in range(12)]
    new = [each + draw.gauss(0.08, 0.1) for each in old]
    found = compared(
        rows_of(old),
        {run: row(run, seconds=seconds) for (run, _), seconds in zip(rows_of(new).items(), new, strict=True)},
    )
    alone = float(stats.wilcoxon([b - a for a, b in zip(old, new, strict=True)]).pvalue)
    assert found["seconds"].p == pytest.approx(min(1.0, 2 * alone), rel=1e-6)


# ---------------------------------------------------------------- the command


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a sweep was done."""
    home = tmp_path_factory.mktemp("swept")
    (home / "small.mission").write_text(MANY, encoding="utf-8")
    words = ["--vary", "N=1,2", "--vary", "R=0.1 m,0.2 m", "--seeds", "1", "--keep", "--quiet"]
    assert main(["sweep", str(home / "small.mission"), *words, "-o", str(home / "out"), "--jobs", "2"]) == 0
    return home


def again(swept: Path, *words: str, seeds: int = 1) -> int:
    file, out = str(swept / "small.mission"), str(swept / "out")
    given = ["--vary", "N=1,2", "--vary", "R=0.1 m,0.2 m", "--seeds", str(seeds), "--format", "json"]
    return main(["sweep", file, *given, "-o", out, *words])


def test_a_sweep_leaves_a_table_a_page_and_plans_that_verify(swept: Path) -> None:
    read = list(csv.DictReader((swept / "out" / "runs.csv").read_text(encoding="utf-8").splitlines()))
    assert [each["outcome"] for each in read] == ["planned"] * 4
    assert [(each["N"], each["R [m]"]) for each in read] == [
        ("1.0", "0.1"),
        ("1.0", "0.2"),
        ("2.0", "0.1"),
        ("2.0", "0.2"),
    ]
    assert main(["verify", str(swept / "out" / "plans" / read[3]["run"])]) == 0
    page = (swept / "out" / "sweep.html").read_text(encoding="utf-8")
    assert page.count(f'plans/{read[0]["run"]}/report.html"') > 3
    assert "<script" not in page
    assert "<svg" in page
    light, dark = page.split("@media (prefers-color-scheme: dark) { :root", 1)
    assert "--paper: #f4f4f2" in light  # as in a report
    assert "--paper: #15181b" in dark


def test_a_plan_of_a_sweep_has_the_bytes_of_the_same_compilation(swept: Path, tmp_path: Path) -> None:
    file = str(swept / "small.mission")
    assert main(["compile", file, "-D", "N=2", "-D", "R=0.2 m", "-o", str(tmp_path / "alone"), "--quiet"]) == 0
    own = swept / "out" / "plans" / "N=2_R=0.2m_seed=0"
    for path in sorted((tmp_path / "alone").rglob("*")):
        if path.is_file():
            assert (own / path.relative_to(tmp_path / "alone")).read_bytes() == path.read_bytes(), path.name


def test_the_same_command_has_nothing_left_to_do(swept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (swept / "out" / "runs.csv").read_bytes()
    assert again(swept) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["over"], said["now"], said["complete"]) == (4, 0, True)
    assert (swept / "out" / "runs.csv").read_bytes() == before


@pytest.mark.parametrize("name", ["sweep.html", "runs.csv"])
def test_the_page_and_the_table_are_not_written_through_a_link(
    name: str, swept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine").write_text("mine")
    (swept / "out" / name).unlink()
    (swept / "out" / name).symlink_to(tmp_path / "mine")
    try:
        assert again(swept) == 1
    finally:
        (swept / "out" / name).unlink()
    assert codes(capsys) == {"MC702"}
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_sweep_is_compared_with_itself(swept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert again(swept, "--compare", str(swept / "out")) == 0
    said = json.loads(capsys.readouterr().out)
    assert {each["verdict"] for each in said["comparisons"]} == {"the same"}


def codes(capsys: pytest.CaptureFixture[str]) -> set[str]:
    return {each["code"] for each in json.loads(capsys.readouterr().out)["diagnostics"]}


def test_nothing_is_started_where_one_combination_is_wrong(
    swept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = str(swept / "small.mission"), tmp_path / "out"
    assert main(["sweep", file, "--vary", "N=1,0.5", "--vary", "Q=1", "-o", str(out), "--format", "json"]) == 1
    assert UNKNOWN_PARAMETER.name in codes(capsys)
    assert not out.exists()
    assert (
        main(
            [
                "sweep",
                file,
                "--vary",
                "N=1,2",
                "--simulate",
                "1",
                "--lose",
                "drone[1]@1",
                "-o",
                str(out),
                "--format",
                "json",
            ]
        )
        == 1
    )
    assert codes(capsys) == {NOT_TO_BE_LOST.name}
    assert (
        main(["sweep", file, "--vary", "N=3", "--compare", str(swept / "out"), "-o", str(out), "--format", "json"]) == 1
    )
    assert codes(capsys) == {NOT_COMPARABLE.name}
    assert not out.exists()


def test_a_worker_of_another_version_ends_the_sweep(
    swept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("missionc.tools.sweep.run_answer.versions_here", lambda: {"missionc": "0.0"})
    assert main(["sweep", str(swept / "small.mission"), "-o", str(tmp_path / "out"), "--format", "json"]) == 1
    assert codes(capsys) == {OTHER_VERSIONS.name}


def ended(words: list[str], journal: Path, number: int, lines: int) -> int:
    """Send a sweep a signal once so many runs are over; how it ended."""
    process = subprocess.Popen(
        [sys.executable, "-m", "missionc", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while process.poll() is None:
        if journal.exists() and journal.read_bytes().count(b"\n") >= lines:
            process.send_signal(number)
            break
        time.sleep(0.01)
    return process.wait()


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGKILL])
def test_a_sweep_that_is_ended_goes_on_where_it_was(tmp_path: Path, number: int, swept: Path) -> None:
    out, file = tmp_path / "out", str(swept / "small.mission")
    words = [
        "sweep",
        file,
        "--vary",
        "N=1,2",
        "--vary",
        "R=0.1 m,0.2 m",
        "-o",
        str(out),
        "--keep",
        "--jobs",
        "1",
        "--quiet",
    ]
    assert ended(words, out / JOURNAL, number, 1) == (130 if number == signal.SIGINT else -number)
    kept = (out / JOURNAL).read_bytes()
    assert 1 <= kept.count(b"\n") < 4
    if number == signal.SIGINT:
        assert len((out / "runs.csv").read_text().splitlines()) == 1 + kept.count(b"\n")
    assert main(words) == 0
    assert (out / JOURNAL).read_bytes().startswith(kept[: kept.rfind(b"\n") + 1])
    assert steady(out) == steady(swept / "out")


@pytest.mark.slow
def test_a_sweep_that_is_killed_at_any_moment_again_and_again_ends_in_the_same_table(
    tmp_path: Path, swept: Path
) -> None:
    draw, killed = random.Random(4), 0
    words = ["sweep", str(swept / "small.mission"), "--vary", "N=1,2", "--vary", "R=0.1 m,0.2 m", "--keep", "--quiet"]
    command = [sys.executable, "-m", "missionc", *words, "-o", str(tmp_path / "out"), "--jobs", "1"]
    while killed < 40:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            assert process.wait(draw.uniform(0.2, 6.0 + killed)) == 0
            break
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            killed += 1
        for name in ("runs.csv", "sweep.html", "sweep.json"):
            left = tmp_path / "out" / name
            assert not left.exists() or left.read_bytes().endswith(b"\n")
    assert killed
    assert steady(tmp_path / "out") == steady(swept / "out")


def steady(folder: Path) -> list[dict[str, str]]:
    """What of a table does not follow from the machine."""
    read = csv.DictReader((folder / "runs.csv").read_text(encoding="utf-8").splitlines())
    return [{name: cell for name, cell in each.items() if name not in OF_THE_MACHINE} for each in read]
