"""A random mission of the whole language in every command and every backend; the answers must agree."""

from __future__ import annotations

import csv
import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from farm.referees import engines, second_reading
from farm.trial import MISSION, Broken, Case, Kind
from missionc.backends.registry import BACKENDS
from missionc.base.diagnostics.code import BEYOND_HORIZON
from missionc.base.source import Source
from missionc.cli.exit_status import Status
from missionc.compiler import driver
from missionc.verification.monitoring.read_trace import read_trace
from tests.support.every_command import codes, said, taken_through
from tests.support.random_flight_missions import random_mission
from tests.support.random_language_missions import random_program

PRESETS = ("search", "paper", "fsot", "mpot")
SECONDS = "1"
"""Time limit of a search in seconds; one without a result by then has answered too."""
MOTIONS = 3
"""Number of random motions of each mission that are monitored."""


def draw(generator: np.random.Generator) -> Case:
    own, seed = np.random.default_rng(generator.integers(2**63)), int(generator.integers(2**31))
    hard_to_fly = generator.random() < 0.15
    files = {MISSION: random_mission(own)} if hard_to_fly else random_program(own)
    flags = ["--time-limit", SECONDS, "--explain-limit", str(generator.choice(["0", "0", "0", "1"]))]
    flags += ["--continuous"] if generator.random() < 0.2 else []
    flags += ["--alternatives", "3"] if generator.random() < 0.3 else []
    if "solve with clot" in files[MISSION] and generator.random() < 0.5:
        flags += ["--preset", str(generator.choice(PRESETS)), "--samples", "4"]
    wishes = {
        "backends": bool(generator.random() < 0.6),
        "simulate": bool(generator.random() < 0.4),
        "replan": bool(generator.random() < 0.4),
        "fly": bool(generator.random() < 0.15),
    }
    return Case(files, {"flags": flags, "seed": seed, **wishes})


def carry_out(case: Case, folder: Path) -> str:
    wishes = case.settings
    home = folder / "mission"
    ended = taken_through(case.files, home, tuple(wishes["flags"]))
    mission, out = home / MISSION, home / "out"
    _read_twice(mission, out, wishes["seed"])
    if ended.outcome == "refused":
        return "refused"
    replies = [engines.Reply("auto", ended.outcome, frozenset(ended.codes), out)]
    if wishes["backends"]:
        replies += [
            _asked(name, mission, folder / name) for name in BACKENDS.built_in if name == "smt" or find_spec("torch")
        ]
    for each in replies[1:]:
        _holds(each, mission, wishes["seed"])
    engines.consistent(replies)
    planned = next((each for each in replies if each.planned), None)
    if planned:
        _flown(planned.folder, mission, case, folder)
        return "planned"
    return ended.outcome


def _asked(engine: str, mission: Path, out: Path) -> engines.Reply:
    words = ["--backend", engine, "--time-limit", SECONDS, "--explain-limit", "0", "--certify", "--quiet"]
    status, document = said("compile", str(mission), "-o", str(out), *words)
    reply = engines.reply(engine, document, out)
    if (status == Status.DONE) != reply.planned or reply.outcome == "unverified":
        promise = "The exit status of a compilation matches its outcome, and every plan is verified."
        raise Broken("outcome", promise, f"{engine}: {status} {document}")
    return reply


def _holds(reply: engines.Reply, mission: Path, seed: int) -> None:
    """Check that `verify` accepts an engine's folder."""
    if reply.planned:
        _read_twice(mission, reply.folder, seed)
    if reply.planned or (reply.outcome == "impossible" and (reply.folder / "manifest.json").exists()):
        status, verified = said("verify", str(reply.folder))
        if status != Status.DONE:
            what = "plan" if reply.planned else "proof of infeasibility"
            raise Broken("verify", f"`verify` accepts every {what} that `compile` writes.", f"{status} {verified}")


def _read_twice(mission: Path, out: Path, seed: int) -> None:
    """Evaluate the plan, if any, and some random motions with both readings of the semantics."""
    checked = driver.check(mission, backend="any")
    beyond = any(finding.code is BEYOND_HORIZON for finding in checked.findings)
    if checked.mission is None or checked.kernel is None or beyond:
        return
    for number in range(MOTIONS):
        motion = second_reading.random_motion(checked.mission, seed + number)
        second_reading.agree(checked.mission, checked.kernel, motion, f"random motion {seed + number}")
    plan = out / "plan.json"
    if plan.exists():
        trace, _ = read_trace(Source(plan.name, plan.read_text(encoding="utf-8")), checked.mission)
        assert trace is not None
        second_reading.agree(checked.mission, checked.kernel, trace, f"plan in {out.name}")


def _flown(out: Path, mission: Path, case: Case, folder: Path) -> None:
    """Run the commands that fly a plan or replan the rest of it."""
    wishes = case.settings
    seed = str(wishes["seed"])
    if wishes["replan"]:
        _replanned(out, folder, wishes["seed"])
    if wishes["fly"]:
        page, scenario = folder / "flights.html", folder / "scenario.toml"
        scenario.write_text("[wind]\nmean = 0.2\n[reports]\nnoise = 0.01\ndropped = 0.05\n", encoding="utf-8")
        words = ["--in", "simulation", "--within", "1", "--scenario", str(scenario), "-o", str(page), "--quiet"]
        status, document = said("fly", str(out), *words, "--seed", seed)
        _answered("fly", status, document)
    if wishes["simulate"]:
        status, document = said("simulate", str(out), "--seed", seed, "--wind", "0.1,0.1", "--quiet")
        _answered("simulate", status, document)
        status, verified = said("verify", str(out))
        if status != Status.DONE:
            raise Broken("verify", "`verify` accepts a folder that `simulate` wrote into.", f"{status} {verified}")


def _replanned(out: Path, folder: Path, seed: int) -> None:
    """Replan the rest of a mission from a moment of its plan on, flown as planned until then."""
    rows = list(csv.DictReader((out / "trajectories.csv").read_text(encoding="utf-8").splitlines()))
    times = sorted({float(row["t"]) for row in rows})
    until = times[1 + seed % max(1, len(times) - 2)] if len(times) > 2 else times[-1]
    flown, anew = folder / "flown.csv", folder / "anew"
    lines = [",".join(rows[0]), *(",".join(row.values()) for row in rows if float(row["t"]) <= until)]
    flown.write_text("\n".join(lines) + "\n", encoding="utf-8")
    words = ["--flown", str(flown), "--within", "1", "-o", str(anew)]
    status, document = said("replan", str(out), *words)
    _answered("replan", status, document)
    if (anew / "manifest.json").exists():
        status, verified = said("verify", str(anew))
        if status != Status.DONE:
            raise Broken("verify", "`verify` accepts every folder that `replan` writes.", f"{status} {verified}")


def _answered(command: str, status: int, document: dict[str, Any]) -> None:
    """Check that a flight command reports success, a violated requirement, or a code."""
    if status not in (Status.DONE, Status.VIOLATED) and not codes(document):
        promise = f"`{command}` succeeds, or reports a code."
        raise Broken(command, promise, f"{status} {json.dumps(document)[:3000]}")


WHOLE_MISSIONS = Kind(
    "whole_missions", "a random mission of the whole language through every command and backend", draw, carry_out, 180.0
)
