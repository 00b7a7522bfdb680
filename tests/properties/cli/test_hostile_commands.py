"""Whatever stands on the command line, a command ends with a documented status and keeps to its folder.

``MISSIONC_FUZZ=5000`` runs so many command lines instead of the usual number; `make fuzz` does.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from missionc.base.diagnostics.render import plain
from missionc.base.limits import Limits
from missionc.cli.app import main
from missionc.cli.exit_status import Status
from tests.support.small_missions import SMALL, WRONG, parked

USUAL = 150
PARTS = 2
DOCUMENTED = {int(status) for status in Status} - {Status.DEFECT}
ODD = "e\x1b[31m\x07\u202e\x9b"

Draw = Callable[[random.Random], str]

NAMES = (
    *("", " ", ".", "..", "-", "--", "-x", "~", "*", "%s", "a b", "a\nb", "a\tb", "\0", "a\0b", "é", "𝄞", ODD),
    *(
        "\udc80",
        "\ud800",
        "n" * 100,
        "n" * 250,
        "n" * 300,
        "p/" * 40 + "q",
        "p/" * 2500 + "q",
        "missing",
        "sub/",
        "./sub",
    ),
    *("/", "/dev/null", "/dev/full", "/dev/null/x", "/proc/self/x", "small.mission", "wrong.mission", "done", "sub"),
    *("empty", "binary", "trace.csv", "loop", "dangling", f"{ODD}.mission", "MC301", "999", "a" * 5000, "CON"),
)
NUMBERS = (
    *("nan", "-nan", "inf", "-inf", "1e400", "1e-400", "1e300", "-0", "-0.0", "0", "-1", "1", "2", "0.5", "1.5", "3"),
    *("9" * 400, "9" * 5000, "1e15", "1e9", "٣", "0x10", "", " ", "1_0", " 1 ", "one", "\0", ODD, "+1", "1e", "--"),
)
READABLE = ("small.mission", "small.mission", "small.mission", "wrong.mission", "odd.mission", f"{ODD}.mission")


def drawn(*values: str) -> Draw:
    return lambda draw: draw.choice(values)


def text(draw: random.Random) -> str:
    return draw.choice((*NAMES, *NUMBERS))


def name(draw: random.Random) -> str:
    return draw.choice(NAMES)


def number(draw: random.Random) -> str:
    return draw.choice(("0.5", "1", "2", "3", "10")) if draw.random() < 0.6 else draw.choice(NUMBERS)


def mission(draw: random.Random) -> str:
    return draw.choice(READABLE) if draw.random() < 0.9 else name(draw)


def compiled(draw: random.Random) -> str:
    return "done" if draw.random() < 0.9 else name(draw)


def output(draw: random.Random) -> str:
    plain = draw.choice(("out", "out.svg", "sub/out.png", f"sub/{ODD}.svg", "done"))
    return plain if draw.random() < 0.5 else draw.choice((*NAMES, f"{name(draw)}.svg", f"{name(draw)}.png"))


def override(draw: random.Random) -> str:
    return f"{draw.choice(('T', 'R', name(draw)))}={text(draw)}"


def limit(draw: random.Random) -> str:
    known = (*Limits.__dataclass_fields__, name(draw))
    return f"{draw.choice(known)}={number(draw)}"


SHARED = {"--format": drawn("text", "json", "json", "json", "sarif", ODD), "--limit": limit}
OF_MISSION = {**SHARED, "-D": override, "--vehicle": drawn("crazyflie", "plain", "", ODD, "n" * 300)}
COMMANDS: dict[str, tuple[tuple[Draw, ...], dict[str, Draw | None]]] = {
    "check": ((mission,), {**OF_MISSION}),
    "compile": (
        (mission,),
        {
            **OF_MISSION,
            "-o": output,
            "--force": None,
            "--from": name,
            "--backend": drawn("auto", "smt", "smt", "hybrid", ""),
            "--solver": drawn("z3", "cadical", "race"),
            "--preset": drawn("sketch", "search", ODD),
            "--samples": number,
            "--margin": number,
            "--processes": drawn("1", "0", "nan", "-1"),
            "--stretch": number,
            "--seed": number,
            "--time-limit": drawn("nan", "inf", "-0", "0", "1e400", "0.001", "1", "2"),
            "--memory-limit": number,
            "--checkpoint": output,
            "--resume": name,
            "--emit": drawn(
                "ast", "ir", "kernel", "cost-graph", "horizons", "backend", "roadmap", "dimacs", "ast,ir", "", ODD
            ),
            "--export": drawn("cflib", "crazyswarm2", "", ODD, "mcap,ros2"),
            "--timings": None,
            "--plot": output,
            "--plot-kind": drawn("map", "roadmap", "timeline", "", ODD),
            "--at": drawn("0", "0,1", "nan", "-1", "1e9", "", ODD),
            "--plot-width": drawn("single", "double", "", ODD),
            "--certify": None,
            "--continuous": None,
            "--at-steps": None,
            "-v": None,
            "--alternatives": drawn("0", "1", "2", "-1", "x"),
            "--explain-limit": number,
            "--quiet": None,
        },
    ),
    "explain": ((mission,), {**SHARED, "-D": override}),
    "export": (
        (compiled, drawn("cflib", "mcap", "px4", "", ODD)),
        {**SHARED, "-o": output, "--force": None, "--from": name},
    ),
    "fmt": ((mission,), {**SHARED, "--check": None, "--diff": None}),
    "init": ((name,), {"--format": drawn("text", "json"), "--template": drawn("patrol", "", ODD), "--force": None}),
    "monitor": (
        (mission, drawn("trace.csv", *NAMES)),
        {
            **SHARED,
            "-D": override,
            "--continuous": None,
            "--tolerance": number,
            "--live": None,
            "--udp": drawn("x", "1:2:3", "-1", "99999", "no.such.host:1", "", ODD),
            "--wait": number,
            "--mcap": drawn("trace.csv", *NAMES),
            "--topic": drawn("/a/pose=scout", "=", "", ODD),
            "--leap": number,
            "--plan": drawn("trace.csv", *NAMES),
            "--skew": drawn("scout=1", "a=b", "x=nan", "=", "", ODD),
        },
    ),
    "fly": (
        (compiled,),
        {
            **SHARED,
            "--in": drawn("simulation", "", ODD),
            "--scenario": drawn("storm.toml", *NAMES),
            "-o": output,
            "--flights": drawn("0", "nan", "-1", "9" * 400),
            "--within": number,
            "--no-replan": None,
            "--seed": number,
            "--pace": number,
        },
    ),
    "replan": (
        (compiled,),
        {
            **SHARED,
            "--flown": drawn("trace.csv", *NAMES),
            "--changed": mission,
            "--lost": drawn("scout", "", ODD),
            "--give-up": drawn("x", "", ODD),
            "--within": number,
            "-o": output,
            "--force": None,
        },
    ),
    "report": ((compiled,), {**SHARED, "-o": output}),
    "simulate": (
        (compiled,),
        {
            **SHARED,
            "--engine": drawn("quadrotor", ODD, ""),
            "--trials": drawn("1", "2", "0", "nan", "-1", "9" * 400),
            "--wind": text,
            "--mass-error": number,
            "--start-error": number,
            "--clock-error": number,
            **dict.fromkeys(("--noise", "--latency", "--packet-loss", "--missed-start", "--battery-sag"), number),
            **dict.fromkeys(("--weak-motor", "--downwash"), number),
            "--lose": drawn("drone[0]@1", "drone[0]@9", "ghost@1", "@", "drone[0]@nan", ODD),
            "--seed": number,
            "--trace": output,
            "--plot": output,
            "--jobs": drawn("1", "0", "nan"),
            "--cluster": drawn("local:0", "nowhere", "", ODD),
            "--quiet": None,
        },
    ),
    "studio": ((mission,), {"--no-open": None}),
    "sweep": (
        (mission,),
        {
            **OF_MISSION,
            "--vary": drawn("T=5 s,6 s", "R=1..2/0.5", "T=2..1", "R=,", "T=1..1e9", "=", "", ODD, f"{ODD}=1"),
            "--seeds": drawn("1", "2", "0", "nan", "9" * 400),
            "-o": output,
            "--jobs": drawn("1", "2", "0", "nan"),
            "--cluster": drawn("local:0", "local:99999", "nowhere", "", ODD, "/dev/null/x"),
            "--compare": drawn("done", *NAMES),
            "--time-limit": drawn("nan", "inf", "-0", "0", "0.001", "1"),
            "--memory-limit": number,
            "--simulate": drawn("0", "1", "-1", "nan"),
            "--wind": text,
            "--lose": drawn("drone[0]@1", "ghost@1", "@", ODD),
            "--keep": None,
            "--plot": output,
            "--plot-width": drawn("single", "", ODD),
            "--quiet": None,
        },
    ),
    "extensions": ((), {"--format": drawn("text", "json", ODD)}),
    "vehicles": ((name,), {"--format": drawn("text", "json", ODD)}),
    "verify": ((compiled,), {**SHARED}),
    ODD: ((name,), {}),
}
"""Of each command, how its arguments and the values of its flags are drawn; None for a flag without a value."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What every command line finds."""
    home = tmp_path_factory.mktemp("commands") / "home"
    home.mkdir()
    (home / "small.mission").write_text(SMALL)
    (home / "wrong.mission").write_text(WRONG)
    (home / "odd.mission").write_text(f"# {ODD}\nparam T = 3 s\n{SMALL}include {json.dumps(ODD)}\n")
    (home / f"{ODD}.mission").write_text(SMALL.replace("goal\n", f"{ODD}\n"))
    (home / "trace.csv").write_text(parked())
    (home / "empty").touch()
    (home / "binary").write_bytes(bytes(range(256)))
    (home / "loop").symlink_to("loop")
    (home / "dangling").symlink_to("nowhere")
    (home / "sub").mkdir()
    assert main(["compile", str(home / "small.mission"), "-o", str(home / "done"), "--quiet"]) == 0
    return home


@pytest.fixture
def anew(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], Path]]:
    """Lays the files out again, in a folder that has another one beside it."""
    (tmp_path / "beside").mkdir()
    (tmp_path / "beside" / "kept").write_text("kept")

    def lay() -> Path:
        monkeypatch.chdir(tmp_path)
        shutil.rmtree(tmp_path / "home", ignore_errors=True)
        shutil.copytree(folder, tmp_path / "home", symlinks=True)
        monkeypatch.chdir(tmp_path / "home")
        return tmp_path

    yield lay
    monkeypatch.chdir(tmp_path)


def command_line(draw: random.Random) -> list[str]:
    """A command with its arguments and some of its flags, now and then one too many or one too few."""
    command = draw.choice(list(COMMANDS))
    arguments, flags = COMMANDS[command]
    words = [argument(draw) for argument in arguments]
    if draw.random() < 0.05:
        words = words[:-1] if draw.random() < 0.5 else [*words, text(draw)]
    for flag in draw.sample(list(flags), min(len(flags), draw.choice((0, 1, 1, 2, 3)))):
        value = flags[flag]
        words += [flag] if value is None else [flag, value(draw)]
    return [command, *words]


@pytest.mark.parametrize("part", range(PARTS))
def test_every_command_line_ends_well(
    part: int, anew: Callable[[], Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MISSIONC_TRACEBACK", "1")
    # It would go on until it is interrupted.
    monkeypatch.setattr("missionc.tools.studio.serve.serve", lambda *_: None)
    for number in range(part, int(os.environ.get("MISSIONC_FUZZ", USUAL)), PARTS):
        words = command_line(random.Random(number))
        if number % 10 == part:
            place = anew()
        status = main(words)
        said = capsys.readouterr()
        about = (number, [word[:60] for word in words], status, said.err[-400:])
        assert status in DOCUMENTED, about
        assert not {"MC901", "MC613"} & set(re.findall(r"MC\d+", said.out + said.err)), about
        assert plain(said.err) == said.err, about
        if "json" in words and status != Status.USAGE and words[0] in COMMANDS:
            json.loads(said.out)
        elif words[0] != "fmt":
            assert plain(said.out) == said.out, about
        assert sorted(os.listdir(place)) == ["beside", "home"], about
        assert sorted(os.listdir(place / "beside")) == ["kept"], about
