"""Shell completion: what a shell is told, and what it then offers."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CODES
from missionc.cli.stage_names import ALL
from missionc.ir.vehicle_profiles import profiles
from missionc.output.export.formats import FORMATS

ROOT = Path(__file__).resolve().parents[3]


def run(**environment: str) -> str:
    command = [sys.executable, "-m", "missionc"]
    whole = {**os.environ, **environment}
    return subprocess.run(command, cwd=ROOT, env=whole, capture_output=True, text=True, check=True).stdout


def offered(*words: str) -> list[str]:
    """What bash is offered for the last of these words: its kind and value each."""
    line = " ".join(["missionc", *words])
    return run(_MISSIONC_COMPLETE="bash_complete", COMP_WORDS=line, COMP_CWORD=str(len(words))).splitlines()


def test_commands_are_completed() -> None:
    assert offered("comp") == ["plain,compile"]
    assert offered("de") == ["plain,demo"]


@pytest.mark.parametrize(
    "words", [("check", "miss"), ("compile", "miss"), ("monitor", "a.mission", "b"), ("compile", "--resume", "r")]
)
def test_files_are_the_shell_s_to_complete(words: tuple[str, ...]) -> None:
    assert offered(*words) == [f"file,{words[-1]}"]


@pytest.mark.parametrize("command", ["report", "verify", "simulate", "export"])
def test_folders_are_the_shell_s_to_complete(command: str) -> None:
    assert offered(command, "build") == ["dir,build"]


def test_names_of_exports_are_completed_also_after_a_comma() -> None:
    assert offered("export", "build", "c") == [f"plain,{name}" for name in FORMATS if name.startswith("c")]
    assert offered("compile", "a.mission", "--export", "cflib,c") == ["plain,cflib,crazyswarm2"]


def test_stages_vehicles_and_codes_are_completed() -> None:
    assert offered("compile", "a.mission", "--emit", "k") == ["plain,kernel"]
    assert "cost-graph" in ALL
    assert offered("vehicles", "crazyflie") == [f"plain,{name}" for name in profiles() if name.startswith("crazyflie")]
    assert offered("explain", "MC30") == [f"plain,{name}" for name in CODES if name.startswith("MC30")]
    assert offered("explain", "missions/w") == ["file,missions/w"]


def test_choices_are_completed() -> None:
    assert offered("check", "--format", "s") == ["plain,sarif"]
    assert offered("compile", "--backend", "h") == ["plain,hybrid"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_line_for_a_shell_s_start_up_file_gives_a_script(shell: str) -> None:
    script = run(_MISSIONC_COMPLETE=f"{shell}_source")
    assert "_MISSIONC_COMPLETE" in script
    assert "missionc" in script
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert f"_MISSIONC_COMPLETE={shell}_source missionc" in page


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
def test_bash_completes_with_that_script(tmp_path: Path) -> None:
    (tmp_path / "missionc").write_text(f'#!/bin/sh\nPYTHONPATH={ROOT} exec {sys.executable} -m missionc "$@"\n')
    (tmp_path / "missionc").chmod(0o755)
    script = (
        'eval "$(_MISSIONC_COMPLETE=bash_source missionc)"\n'
        "COMP_WORDS=(missionc vehicles crazyflie2) COMP_CWORD=2\n"
        '"$(complete -p missionc | sed \'s/.*-F \\([^ ]*\\).*/\\1/\')" missionc\necho "${COMPREPLY[@]}"\n'
    )
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [name for name in profiles() if name.startswith("crazyflie2")]
