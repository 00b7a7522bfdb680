"""A mission on lanes with an exhaustive search of joint motions: planned if one satisfies it, else impossible."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from farm.referees import engines
from farm.trial import Broken, Case, Kind
from missionc import ir
from missionc.cli.exit_status import Status
from missionc.compiler import driver
from tests import reference
from tests.support.every_command import codes, said
from tests.support.exhaustive_lanes import files_on_lanes, joint_motions

SECONDS = "20"
"""Seconds, far more than needed for two agents and five places."""


def draw(generator: np.random.Generator) -> Case:
    return Case(files_on_lanes(int(generator.integers(2**31))))


def carry_out(case: Case, folder: Path) -> str:
    mission, out = case.laid(folder / "mission"), folder / "out"
    words = ["--time-limit", SECONDS, "--explain-limit", "0", "--certify", "--at-steps", "--quiet"]
    status, document = said("compile", str(mission), "-o", str(out), *words)
    checked = driver.check(mission, backend="any")
    if checked.mission is None:
        return "refused"
    reply = engines.reply("smt", document, out)
    possible = satisfiable(checked.mission)
    seen = f"{reply.outcome} {sorted(reply.codes)}, but some motion satisfies the mission: {possible}"
    referee = " ".join(["all motions", *sorted(reply.codes)])
    if reply.planned and not possible:
        raise Broken(referee, "A mission that no joint motion on its lanes satisfies has no plan.", seen)
    if possible and (reply.no_motion or reply.no_roadmap or engines.refused_as_impossible(reply)):
        raise Broken(referee, "A mission with a joint motion on its lanes is not reported as impossible.", seen)
    if reply.planned or (out / "manifest.json").exists():
        status, verified = said("verify", str(out))
        if status != Status.DONE:
            raise Broken("verify", "`verify` accepts every plan and proof that `compile` writes.", verified)
    return reply.outcome if reply.outcome != "refused" else f"refused, {' '.join(codes(document))}"


def satisfiable(mission: ir.Mission) -> bool:
    """Return whether some joint motion without collisions satisfies all requirements."""
    goals = [each.formula for each in mission.requirements]
    return any(all(reference.truth(goal, run, 0, 0) for goal in goals) for run in joint_motions(mission))


LANES = Kind("lanes", "a mission on lanes, against all joint motions there are", draw, carry_out)
