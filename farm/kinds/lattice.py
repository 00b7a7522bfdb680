"""A small mission with an exhaustive search on a lattice: if it has a plan, no answer may be impossible."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np

from farm.referees import engines
from farm.trial import MISSION, Broken, Case, Kind
from missionc.backends.registry import BACKENDS
from missionc.cli.exit_status import Status
from missionc.compiler import driver
from tests.support.every_command import codes, said
from tests.support.exhaustive_lattice import Small, satisfied

SECONDS = "2"


def draw(generator: np.random.Generator) -> Case:
    seed = int(generator.integers(2**31))
    backend = str(generator.choice(["auto", "auto", *BACKENDS.built_in]))
    return Case({MISSION: Small(seed).text}, {"seed": seed, "backend": backend})


def carry_out(case: Case, folder: Path) -> str:
    engine = case.settings["backend"]
    if engine not in ("smt", "auto") and not find_spec("torch"):
        return "skipped, torch is not installed"
    mission, out = case.laid(folder / "mission"), folder / "out"
    words = ["--backend", engine, "--time-limit", SECONDS, "--explain-limit", "0", "--certify", "--quiet"]
    status, document = said("compile", str(mission), "-o", str(out), *words)
    resolved = driver.check(mission, backend="any").mission
    if resolved is None:
        return "refused"
    reply = engines.reply(engine, document, out)
    if reply.no_motion or engines.refused_as_impossible(reply):
        witness = next((plan for plan in Small(case.settings["seed"]).plans() if satisfied(resolved, plan)), None)
        if witness:
            promise = "A mission with a plan from cell to cell is not reported as impossible."
            raise Broken(f"all plans, {' '.join(sorted(reply.codes))}", promise, f"{reply.outcome}, and {witness}")
    if reply.planned or (out / "manifest.json").exists():
        status, verified = said("verify", str(out))
        if status != Status.DONE:
            raise Broken("verify", "`verify` accepts every plan and proof that `compile` writes.", verified)
    return reply.outcome if reply.outcome != "refused" else f"refused, {' '.join(codes(document))}"


LATTICE = Kind("lattice", "a small mission, compared with all plans on a lattice of cells", draw, carry_out)
