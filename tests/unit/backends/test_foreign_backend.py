"""Backends of extensions: a claim that no plan exists, beside the compiler's own proofs."""

from __future__ import annotations

import missionc
from missionc.backends.api import BackendExtension, Budget, Impossible, Outcome, Report
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

MISSION = """mission crossing
time step 1 s, horizon 4 s
world (0, 0) to (4, 2)
region east = box (3.7, 0) to (4, 2)
region west = box (0, 0) to (0.3, 2)
team cart[1] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (2, 1) }
require there: every cart: eventually[0, 4 s] east
require back: every cart: eventually[0, 4 s] west
"""


class Pessimist(BackendExtension):
    """Every mission is impossible."""

    name = "pessimist"

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        return Impossible(("there",), "too far", Report())


def test_a_claim_that_no_plan_exists_is_an_answer_if_the_compiler_proves_it() -> None:
    compiled = missionc.compile(Source("crossing.mission", MISSION), backend=Pessimist())
    assert [each.code.name for each in compiled.findings] == ["MC609"]
    assert isinstance(compiled.outcome, missionc.Impossible)
    assert compiled.outcome.conflict == ("there", "back")
