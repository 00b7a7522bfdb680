"""No command writes over what it reads, or over the folder in which it runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from missionc.cli.app import main
from missionc.output.folder.overlap import WrittenPath, overlapping
from tests.support.output_folders import content, written
from tests.support.small_missions import SMALL

Captured = pytest.CaptureFixture[str]

INCLUDED = 'include "parts/world.mission"\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the command runs: a mission, what it includes, another mission, and a folder of the compiler's."""
    here = tmp_path / "work"
    (here / "parts").mkdir(parents=True)
    world = "world (0, 0) to (4, 4)\n"
    assert world in SMALL
    (here / "a.mission").write_text(SMALL.replace(world, INCLUDED))
    (here / "parts" / "world.mission").write_text(world)
    (here / "b.mission").write_text(SMALL)
    written(here / "ours", {"plan.json": b"{}\n"})
    monkeypatch.chdir(here)
    return here


@pytest.mark.parametrize(
    "words",
    [
        ["-o", "."],
        ["-o", ".."],
        ["-o", "../work"],
        ["-o", "parts"],
        ["-o", "ours/.."],
        ["-o", "a.mission"],
        ["-o", "/"],
        ["-o", "to_here"],
        ["-o", "to_ours"],
        ["--plot", "picture.svg"],
        ["--checkpoint", "a.mission"],
        ["--checkpoint", "parts/../a.mission"],
        ["--checkpoint", "to_mission"],
        ["--checkpoint", "hard_mission"],
        ["--checkpoint", "parts/world.mission"],
        ["--checkpoint", "ours/run.npz", "-o", "ours"],
        ["--checkpoint", "new/run.npz", "-o", "new"],
        ["--plot", "new/map.svg", "-o", "new"],
        ["--plot", "map.svg", "--checkpoint", "map.svg"],
    ],
)
def test_compile_refuses_outputs_that_would_fall_on_what_is_there(
    folder: Path, words: list[str], capsys: Captured
) -> None:
    (folder / "to_here").symlink_to(".")
    (folder / "to_ours").symlink_to("ours")
    (folder / "to_mission").symlink_to("a.mission")
    (folder / "picture.svg").symlink_to("parts/world.mission")
    (folder / "hard_mission").hardlink_to(folder / "a.mission")
    before = content(folder.parent)
    assert main(["compile", "a.mission", *words, "--force", "--quiet", "--backend", "smt"]) == 1
    said = capsys.readouterr().err
    assert "error[MC701]" in said or "error[MC702]" in said
    assert "help: name another" in said
    assert content(folder.parent) == before


def test_a_mission_in_a_folder_of_the_compiler_s_own_is_not_replaced_with_that(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "b.mission", "-o", "out", "--quiet"]) == 0
    before = content(folder)
    mission = next((folder / "out" / "mission").iterdir()).relative_to(folder)
    assert main(["compile", str(mission), "-o", "out", "--quiet", "--force"]) == 1
    assert f"contains `{mission}`, an input of this command" in capsys.readouterr().err
    assert content(folder) == before


def test_the_folder_in_which_a_command_runs_is_not_replaced(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder / "ours")
    before = content(folder)
    assert main(["compile", "../b.mission", "-o", "../ours", "--quiet", "--force"]) == 1
    assert "`../ours` exists and is the working directory of this command" in capsys.readouterr().err
    assert content(folder) == before


def test_an_export_does_not_replace_what_it_is_made_of(folder: Path, capsys: Captured) -> None:
    assert main(["compile", "b.mission", "-o", "build/out", "--quiet"]) == 0
    before = content(folder)
    for target in ("build/out", "build", "build/out/mission", "build/out/new", "."):
        assert main(["export", "build/out", "px4", "-o", target, "--force"]) == 1
        assert "error[MC70" in capsys.readouterr().err
        assert content(folder) == before


def test_a_run_may_be_kept_in_the_file_that_it_goes_on_from_and_no_other_input_is_a_folder_s(tmp_path: Path) -> None:
    inputs = [tmp_path / "a.mission"]
    outputs = [WrittenPath("-o", tmp_path / "out", True), WrittenPath("--checkpoint", tmp_path / "run.npz")]
    assert overlapping(outputs, inputs) is None
    refused = overlapping(outputs, [*inputs, tmp_path / "run.npz"])
    assert refused is not None
    assert refused.help == "name another file with `--checkpoint`"


def test_names_that_no_file_can_have_are_refused_and_no_defect() -> None:
    for name in ("a\0b", "\ud800", "a" * 300, "a/" * 2500):
        refused = overlapping(
            [WrittenPath("-o", Path(name), True), WrittenPath("--plot", Path(name) / "a.svg")], [Path("b")]
        )
        assert refused is not None
