"""Names, numbers and places that no command can take are refused in a line, and shown so that a terminal is unmoved."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import pytest

from missionc.base.diagnostics.render import plain
from missionc.base.limits import DEEPEST, Limits
from missionc.cli.app import main
from tests.support.small_missions import SMALL, WRONG

ODD = "\x1b[31m\x07\x7f\x9b\u202e\u2066\n"
NOT_NUMBERS = ["nan", "-nan", "inf", "-inf", "1e400", "-1", "", "one"]
OF_FLOATS = [
    *("compile small.mission --stretch", "compile small.mission --time-limit", "compile small.mission --margin"),
    *("compile small.mission --explain-limit", "compile small.mission --memory-limit", "simulate done --mass-error"),
    *("simulate done --start-error", "simulate done --clock-error", "simulate done --wind"),
]
OF_PATHS = [
    *("check", "explain", "compile", "fmt", "verify", "report", "monitor small.mission", "compile small.mission -o"),
    *("compile small.mission --plot", "compile small.mission --checkpoint", "compile small.mission --resume"),
    *("report done -o", "simulate done --trace", "simulate done --plot", "demo -o", "monitor"),
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    home = tmp_path / "home"
    (home / "done").mkdir(parents=True)
    (home / "small.mission").write_text(SMALL)
    monkeypatch.chdir(home)
    monkeypatch.setenv("MISSIONC_TRACEBACK", "1")
    yield home
    monkeypatch.chdir(tmp_path)


def test_what_is_no_finite_number_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], subtests: pytest.Subtests
) -> None:
    for value, words in product(NOT_NUMBERS, OF_FLOATS):
        with subtests.test(value=value, words=words):
            assert main([*words.split(), value]) == 2
            assert capsys.readouterr().err.count("Error: ") == 1


def test_a_limit_is_a_number_that_can_be_held(
    folder: Path, capsys: pytest.CaptureFixture[str], subtests: pytest.Subtests
) -> None:
    for value, name in product([*NOT_NUMBERS, "1e300", "1e16", "0", "-0", "0.5"], Limits.__dataclass_fields__):
        with subtests.test(value=value, name=name):
            whole = name == "magnitude" and value == "0.5"
            assert main(["check", "small.mission", "--limit", f"{name}={value}"]) == (1 if whole else 2)
            assert "MC901" not in capsys.readouterr().err


def test_nesting_is_not_raised_beyond_what_every_pass_holds(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "small.mission", "--limit", f"nesting={DEEPEST + 1}"]) == 2
    assert "at most 256" in capsys.readouterr().err
    with pytest.raises(ValueError, match=r"^the limit `nesting` must be above 0 and at most 256$"):
        Limits(nesting=15_000)
    nested = "not (" * (DEEPEST // 2) + "base" + ")" * (DEEPEST // 2)
    (folder / "deep.mission").write_text(SMALL + f"require deep: some drone: always[0, 6 s] {nested}\n")
    for command in (
        "check deep.mission",
        "explain deep.mission",
        "compile deep.mission --emit ast,ir,kernel,cost-graph",
    ):
        assert main(command.split()) in (0, 1)


def test_a_path_that_no_system_has_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], subtests: pytest.Subtests
) -> None:
    for name, words in product(["n" * 300, "p/" * 2_500 + "q", "", "a\0b", "\ud800"], OF_PATHS):
        with subtests.test(name=name, words=words):
            assert main([*words.split(), name]) == 2
            assert sorted(os.listdir(folder)) == ["done", "small.mission"]


@pytest.mark.parametrize(
    "words", ["check a", "compile a", "demo", "init", "fmt a", "verify a", "report .", "explain MC301"]
)
def test_a_working_directory_that_is_gone_is_said(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MISSIONC_TRACEBACK", "1")
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    status = main(words.split())
    monkeypatch.chdir(tmp_path)
    assert status == {"explain MC301": 0, "demo": 1, "init": 1}.get(words, 2)
    assert status != 1 or "no longer exists" in capsys.readouterr().err


def test_nothing_that_a_terminal_acts_on_reaches_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / f"{ODD}.mission").write_text(SMALL)
    (folder / f"wrong{ODD}.mission").write_text(WRONG)
    for words in (
        ["check", f"{ODD}.mission"],
        ["check", f"wrong{ODD}.mission"],
        ["check", f"missing{ODD}"],
        ["check", "small.mission", "-D", f"{ODD}={ODD}"],
        ["check", "small.mission", "--limit", f"{ODD}=3"],
        ["compile", "small.mission", "--emit", ODD],
        ["explain", f"{ODD}.mission", ODD],
        ["init", ODD],
        ["vehicles", ODD],
        [ODD],
    ):
        main(words)
        said = capsys.readouterr()
        assert plain(said.err) == said.err
        assert plain(said.out) == said.out
        assert "\\x07" in said.err + said.out


def test_a_document_for_programs_has_names_exactly(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = f"wrong{ODD}\udce4.mission"
    (folder / name).write_text(WRONG)
    assert main(["check", name, "--format", "json"]) == 1
    said = capsys.readouterr().out
    assert plain(said) == said
    assert json.loads(said)["files"] == [{"file": name, "ok": False, "places": []}]
