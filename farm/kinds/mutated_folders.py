"""A compiled folder with one random change: `verify` rejects it, or its meaning is unchanged."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from farm.trial import MISSION, Broken, Case, Kind
from missionc.cli.exit_status import Status
from tests.support.every_command import said
from tests.support.folders_as_read import judged
from tests.support.random_language_missions import random_program
from tests.support.small_missions import CONFLICT
from tests.support.whole_folder import MISSION as WHOLE

CHANGES = 12
"""Number of successive changes of each folder."""
EXPORTS = "crazyswarm2,cflib,skybrush,ros2,px4"


def draw(generator: np.random.Generator) -> Case:
    own = np.random.default_rng(generator.integers(2**63))
    files = random_program(own) if generator.random() < 0.7 else {MISSION: WHOLE}
    seeds = [int(seed) for seed in generator.integers(2**31, size=CHANGES)]
    kind = float(generator.random())
    if kind < 0.15:
        return Case({MISSION: CONFLICT}, {"seeds": seeds, "proof": True, "simulate": False})
    return Case(files, {"seeds": seeds, "proof": False, "simulate": kind < 0.5})


def carry_out(case: Case, folder: Path) -> str:
    mission, out = case.laid(folder / "mission"), folder / "out"
    limits = ["--time-limit", "2", "--explain-limit", "0", "--quiet"]
    if case.settings["proof"]:
        status, refused = said("compile", str(mission), "-o", str(out), "--certify", "--explain-limit", "0", "--quiet")
        assert status == Status.NO_MOTION, refused
        _judge(out, case, of_plan=False)
        return "proof judged"
    status, _ = said("compile", str(mission), "-o", str(out), *limits, "--export", EXPORTS)
    if status != Status.DONE:
        status, _ = said("compile", str(mission), "-o", str(out), *limits)
    if status != Status.DONE:
        out = folder / "instead"
        mission.write_text(WHOLE, encoding="utf-8")
        status, _ = said("compile", str(mission), "-o", str(out), "--quiet")
        assert status == Status.DONE
    if case.settings["simulate"]:
        said("simulate", str(out), "--quiet")
    _judge(out, case, of_plan=True)
    return "judged"


def _judge(out: Path, case: Case, of_plan: bool) -> None:
    files = {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}
    for seed in case.settings["seeds"]:
        with warnings.catch_warnings():
            verdict, what = judged(files, seed, of_plan)
        if verdict not in ("refused", "accepted"):
            name, _, change = what.partition(": ")
            promise = "A changed folder is refused with a code, or its contents still mean the same."
            raise Broken(f"{name}, {verdict}", promise, f"change {seed}: {change}")


MUTATED_FOLDERS = Kind("mutated_folders", "a plan folder with one random change", draw, carry_out, 240.0, of_text=False)
