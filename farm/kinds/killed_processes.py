"""A command killed at a random moment: its target is old or new, and no process remains.

A signal that can be caught also leaves nothing beside it; what SIGKILL leaves there, the next command clears away.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numpy as np

from farm.ended_command import Moment, document, run
from farm.trial import MISSION, Broken, Case, Kind
from missionc.cli.exit_status import Status
from missionc.output.folder.ownership import Ours, ownership
from missionc.output.folder.staging import NAME
from tests.support.every_command import said
from tests.support.small_missions import SMALL

SIGNALS = {"SIGKILL": 137, "SIGTERM": 143, "SIGINT": 130, "SIGHUP": 129}
"""Signals that end a command, with their status."""
COMMANDS = ("compile", "compile anew", "simulate", "report", "export", "fly", "sweep", "fmt")
SOON = ("--time-limit", "20", "--explain-limit", "0", "--quiet")


def draw(generator: np.random.Generator) -> Case:
    text = SMALL.replace("drone[2]", f"drone[{generator.integers(1, 4)}]")
    return Case(
        {MISSION: text},
        {
            "command": str(generator.choice(COMMANDS)),
            "signal": str(generator.choice(["SIGKILL", "SIGKILL", *SIGNALS])),
            "at_change": bool(generator.random() < 0.7),
            "share": float(generator.random()),
        },
    )


def carry_out(case: Case, folder: Path) -> str:
    """Run the command once to its end, to measure its time and changes, and once to the moment."""
    wishes, homes = case.settings, (folder / "whole", folder / "killed")
    whole, killed = (prepared(wishes["command"], case, home) for home in homes)
    first = run(words_of(wishes["command"], homes[0]), homes[0])
    if first.status not in (Status.DONE, Status.VIOLATED):
        raise Broken("whole", "A command without a signal succeeds.", f"{first.status} {first.said}")
    count = 1 + int(wishes["share"] * first.changes) if wishes["at_change"] else 0
    moment = Moment(wishes["signal"], count, wishes["share"] * first.seconds)
    before = state(killed)
    ended = run(words_of(wishes["command"], homes[1]), homes[1], moment)
    about = f"{wishes['command']}, {moment}: {ended}"
    if ended.left:
        raise Broken("left over", "All child processes end with their command.", about)
    if ended.status not in (first.status, SIGNALS[wishes["signal"]]):
        raise Broken(f"status {ended.status}", "The exit status of an interrupted command reports the signal.", about)
    if "Traceback" in ended.said:
        raise Broken("traceback", "An interrupted command shows no traceback.", about)
    if wishes["signal"] != "SIGKILL":
        nothing_beside(homes[1], f"{wishes['command']} leaves", about)
    _old_or_new(wishes["command"], homes[1], before, state(whole), about)
    return "ended" if ended.status != first.status else "done before"


def prepared(command: str, case: Case, home: Path) -> Path:
    """Target of the command, with its inputs prepared and its folder created."""
    mission = case.laid(home)
    if command not in ("compile anew", "sweep", "fmt"):
        status, compiled = said("compile", str(mission), "-o", str(home / "out"), *SOON)
        assert status == Status.DONE, compiled
    return home / TARGETS[command]


TARGETS = {
    "compile": "out",
    "compile anew": "out",
    "simulate": "out",
    "report": "page.html",
    "export": "exported",
    "fly": "flights.html",
    "sweep": "sweep",
    "fmt": MISSION,
}
"""Target of each command, in the folder of its mission."""


def words_of(command: str, home: Path) -> list[str]:
    out, target, mission = str(home / "out"), str(home / TARGETS[command]), str(home / MISSION)
    return {
        "compile": ["compile", mission, "-o", out, "--force", "--seed", "1", *SOON],
        "compile anew": ["compile", mission, "-o", out, *SOON],
        "simulate": ["simulate", out, "--quiet"],
        "report": ["report", out, "-o", target],
        "export": ["export", out, "crazyswarm2", "-o", target],
        "fly": ["fly", out, "--in", "simulation", "-o", target, "--quiet"],
        "sweep": ["sweep", mission, "--seeds", "3", "--jobs", "2", "-o", target, "--quiet"],
        "fmt": ["fmt", mission],
    }[command]


def _old_or_new(command: str, home: Path, before: dict[str, str], after: dict[str, str], about: str) -> None:
    target = home / TARGETS[command]
    if command == "sweep":
        again = run([*words_of(command, home), "--format", "json"], home)
        if again.status != Status.DONE or not document(again)["complete"]:
            raise Broken("sweep", "An interrupted sweep continues with its remaining runs.", f"{about}\n{again}")
    # Whoever writes beside it clears away what a process left that was killed.
    status, beside = said("compile", str(home / MISSION), "-o", str(home / "beside"), *SOON)
    if status != Status.DONE:
        raise Broken("beside", "Files left by a killed process do not stop later commands.", f"{about}\n{beside}")
    nothing_beside(home, f"{command} leaves for good", about)
    now = state(target)
    if command in ("compile", "compile anew", "export", "simulate") and now and now != before:
        owner = ownership(target)
        missing = isinstance(owner, Ours) and [name for name in owner.files if not (target / name).exists()]
        if not isinstance(owner, Ours) or missing:
            raise Broken(
                f"{command} half", "A folder is written completely or not at all.", f"{about}\n{owner} {missing}"
            )
    elif now not in (before, after) and command != "sweep":
        raise Broken(
            f"{command} half", "A file has either its old or its new content.", f"{about}\n{before}\n{now}\n{after}"
        )
    if command in ("compile", "simulate") and before and not now:
        raise Broken(f"{command} lost", "A replaced folder has either its old or its new content.", about)
    if command in ("compile", "compile anew", "simulate") and now:
        status, verified = said("verify", str(target))
        if status != Status.DONE:
            raise Broken(f"{command} verify", "`verify` accepts the remaining folder.", verified)


def state(target: Path) -> dict[str, str]:
    """Hash of each file at or below a path; empty if there is none."""
    paths = [target] if target.is_file() else sorted(path for path in target.rglob("*") if path.is_file())
    return {str(path.relative_to(target)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def nothing_beside(home: Path, referee: str, about: str) -> None:
    """Check that there is no staging folder here or in a subfolder."""
    strange = [str(path.relative_to(home)) for path in home.rglob("*") if NAME.fullmatch(path.name)]
    strange += [name for name in os.listdir(home) if ".before-" in name or ".kept-" in name]
    if strange:
        raise Broken(f"{referee} {len(strange)}", "No temporary files remain beside the output.", f"{strange}\n{about}")


KILLED_PROCESSES = Kind(
    "killed_processes", "a command that a signal interrupts at a random time", draw, carry_out, 240.0, of_text=False
)
