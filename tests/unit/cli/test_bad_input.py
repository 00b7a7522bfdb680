"""Hostile and hapless input: each ends in a coded message or a clear line, the right status, and little memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from missionc.cli.app import main
from tests.support.small_missions import SMALL

ROOT = Path(__file__).resolve().parents[3]
MOST_MEMORY = 256 << 20
"""Bytes that may be in memory at once."""


@dataclass(frozen=True, slots=True)
class Run:
    status: int
    out: str
    err: str
    peak: int


LAUNCH = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[2:])
_, status, usage = os.wait4(process.pid, 0)
with open(sys.argv[1], "w") as report:
    report.write(f"{os.waitstatus_to_exitcode(status)} {usage.ru_maxrss}")
"""
"""A small process in between: one that is started counts the memory of the one that starts it among its own."""


def missionc(*words: str, folder: Path) -> Run:
    """The command in a process of its own, and the most memory it had."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    report = folder / ".report"
    with (folder / ".out").open("w+") as out, (folder / ".err").open("w+") as err:
        subprocess.run(
            [sys.executable, "-I", "-S", "-c", LAUNCH, str(report), sys.executable, "-m", "missionc", *words],
            cwd=folder,
            env=environment,
            stdout=out,
            stderr=err,
            check=True,
        )
        status, kibibytes = map(int, report.read_text().split())
        out.seek(0)
        err.seek(0)
        return Run(status, out.read(), err.read(), kibibytes * 1024)


def with_line(line: str) -> str:
    return SMALL + line + "\n"


def doubling(times: int) -> str:
    lets = [f"let a{number} = a{number - 1} and a{number - 1}" for number in range(1, times + 1)]
    return with_line("\n".join(["let a0 = base", *lets, f"require big: every drone: always[0, 6 s] a{times}"]))


TEXTS: dict[str, tuple[bytes | str, str]] = {
    "nothing": ("", "MC003"),
    "only white space and comments": (" \n# a\n\n", "MC003"),
    "binary": (bytes(range(256)) * 4, "MC002"),
    "utf-16": (SMALL.encode("utf-16"), "MC002"),
    "ten megabytes": (b"# x\n" * (10 << 18), "MC004"),
    "ten thousand parentheses": (with_line("require a: " + "(" * 10_000 + "true" + ")" * 10_000), "MC005"),
    "ten thousand negations": (with_line("require a: every drone: " + "not " * 10_000 + "base"), "MC005"),
    "ten thousand minus signs": (with_line("param a = " + "(" + "-" * 10_000 + "1)"), "MC005"),
    "ten thousand braces": (with_line("{" * 10_000), "MC001"),
    "a million agents": (SMALL.replace("drone[2]", "drone[1000000]"), "MC513"),
    "a number of 5,000 digits": (with_line("param a = " + "9" * 5_000), "MC006"),
    "a member of 5,000 digits": (with_line("require a: drone[" + "9" * 5_000 + "]: base"), "MC006"),
    "1e400": (with_line("param a = 1e400"), "MC006"),
    "a step of nothing": (SMALL.replace("step 1 s", "step 0 s"), "MC210"),
    "a negative step": (SMALL.replace("step 1 s", "step (-1 s)"), "MC210"),
    "a tiny step": (SMALL.replace("step 1 s", "step 0.000001 s"), "MC306"),
    "a region without area": (with_line("region flat = box (1, 1) to (1, 3)"), "MC512"),
    "a world without area": (SMALL.replace("to (4, 4)", "to (0, 4)"), "MC512"),
    "division by nothing": (with_line("param a = (1 / 0)"), "MC"),
    "an include of itself": (with_line('include "bad.mission"'), "MC011"),
    "an include of an absolute path": (with_line('include "/etc/passwd"'), "MC010"),
    "an include above the folder": (with_line('include "../outside.mission"'), "MC010"),
    "an include through a link": (with_line('include "link.mission"'), "MC010"),
    "an include of a folder": (with_line('include "."'), "MC002"),
    "a name of a thousand letters": (with_line("region " + "a" * 1_000 + " = box (0, 0) to (1, 1)"), "MC007"),
    "a name that turns the text around": (with_line("region a\u202eb = box (0, 0) to (1, 1)"), "MC"),
    "a route of a billion hops": (
        with_line("graph radio = proximity 1 m\nrequire a: every drone: base reach[hops 999999999..999999999] base"),
        "MC307",
    ),
    "a window of a billion steps": (with_line("require a: every drone: always[0, 999999999 s] base"), "MC301"),
    "a parameter that needs itself": (with_line("param a = b\nparam b = a"), "MC107"),
    "a formula that needs itself": (with_line("let a = not a\nrequire b: every drone: a"), "MC107"),
    "a polygon of fifty thousand corners": (
        with_line("region star = polygon " + ", ".join(f"({n % 7}, {n % 11})" for n in range(50_000))),
        "MC",
    ),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_bad_mission_is_refused_with_a_code_in_little_memory(name: str, tmp_path: Path) -> None:
    content, code = TEXTS[name]
    folder = tmp_path / "home"
    folder.mkdir()
    (tmp_path / "outside.mission").write_text("# out")
    (folder / "link.mission").symlink_to(tmp_path / "outside.mission")
    (folder / "bad.mission").write_bytes(content if isinstance(content, bytes) else content.encode())
    run = missionc("check", "bad.mission", "--format", "json", folder=folder)
    findings = json.loads(run.out)["diagnostics"]
    assert run.status == 1
    assert run.err == ""
    assert any(finding["code"].startswith(code) for finding in findings if finding["severity"] == "error"), findings
    assert not any(finding["code"] == "MC901" for finding in findings), findings
    assert run.peak < MOST_MEMORY


def test_a_chain_of_lets_that_doubles_sixty_times_is_shared_or_refused_but_never_written_out(tmp_path: Path) -> None:
    (tmp_path / "bad.mission").write_text(doubling(60))
    run = missionc("compile", "bad.mission", "--emit", "kernel", "--format", "json", folder=tmp_path)
    assert run.status == 1
    assert [each["code"] for each in json.loads(run.out)["diagnostics"]] == ["MC207"]
    assert run.peak < MOST_MEMORY


def test_includes_that_include_each_other_and_go_too_deep_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in range(40):
        (tmp_path / f"a{number}.mission").write_text(f'include "a{number + 1}.mission"\n')
    (tmp_path / "a40.mission").write_text("# the end\n")
    assert main(["check", str(tmp_path / "a0.mission")]) == 1
    assert "MC012" in capsys.readouterr().err
    (tmp_path / "b.mission").write_text('include "c.mission"\n')
    (tmp_path / "c.mission").write_text('include "b.mission"\n')
    assert main(["check", str(tmp_path / "b.mission")]) == 1
    assert "MC011" in capsys.readouterr().err


Spoil = Callable[[Path, pytest.MonkeyPatch], None]


def read_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may write everywhere, so the system is asked in its stead."""
    monkeypatch.setattr(os, "access", lambda *arguments, **named: False)


def full(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)


def taken_by_a_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "build").write_text("in the way")


@pytest.mark.parametrize("spoil", [read_only, full, taken_by_a_file])
def test_an_output_that_cannot_be_written_is_said_and_leaves_nothing(
    spoil: Spoil, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.mission").write_text(SMALL)
    spoil(tmp_path, monkeypatch)
    before = sorted(tmp_path.rglob("*"))
    assert main(["compile", "small.mission", "--quiet"]) == 1
    assert capsys.readouterr().err.startswith("error[MC702]")
    assert [path for path in sorted(tmp_path.rglob("*")) if path.name != "build"] == [
        path for path in before if path.name != "build"
    ]


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", "MC704"),
        (b"\0\0", "MC704"),
        (b"[" * 100_000, "MC704"),
        (b'{"times": [' + b"9" * 5_000 + b'], "agents": []}', "MC70"),
        (b'{"times": [NaN], "agents": [{"name": "drone[0]"}]}', "MC704"),
        (b'{"times": 3, "agents": {}}', "MC704"),
        (b"agent,t,x,y\ndrone[0],0,1e999,1\n", "MC704"),
        (b"agent,t,x,y\ndrone[0],0,1\n", "MC704"),
        (b'agent,t,x,y\n"drone[0],0,1,1\n', "MC70"),
        (b"agent,t,x,y\nghost,0,1,1\n", "MC705"),
    ],
)
def test_a_bad_trace_is_refused_with_a_code(
    content: bytes, code: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "small.mission").write_text(SMALL)
    (tmp_path / "trace").write_bytes(content)
    assert main(["monitor", str(tmp_path / "small.mission"), str(tmp_path / "trace"), "--format", "json"]) == 1
    findings = json.loads(capsys.readouterr().out)["diagnostics"]
    assert all(finding["code"].startswith(code) for finding in findings)
    assert findings
