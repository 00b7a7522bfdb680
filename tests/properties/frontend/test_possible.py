"""What `check` calls impossible has no plan: random small missions, with every plan on a lattice tried."""

from __future__ import annotations

import os

from missionc import ir
from missionc.base.diagnostics.code import BARRED, BEYOND_HORIZON, CROWDED, JUMP, RESTLESS, TOO_FAR, Code
from missionc.base.source import Source
from missionc.compiler.front_end import check
from tests.support.exhaustive_lattice import SAY_IMPOSSIBLE, Small, satisfied

COUNT = int(os.environ.get("MISSIONC_FUZZ", "800"))


def resolved(text: str) -> tuple[ir.Mission | None, set[Code]]:
    checked = check(Source("small.mission", text), backend="any")
    return checked.mission, {finding.code for finding in checked.findings if not finding.code.warning}


def test_what_check_refuses_has_no_plan_on_the_lattice() -> None:
    refused: dict[Code, int] = {}
    for seed in range(COUNT):
        small = Small(seed)
        mission, codes = resolved(small.text)
        said = codes & SAY_IMPOSSIBLE
        if mission is None or not said or BEYOND_HORIZON in codes:
            continue
        assert not any(satisfied(mission, plan) for plan in small.plans()), small.text
        for code in said:
            refused[code] = refused.get(code, 0) + 1
    assert sum(refused.values()) >= COUNT // 20
    assert {TOO_FAR, BARRED, JUMP, RESTLESS, CROWDED} <= refused.keys()
