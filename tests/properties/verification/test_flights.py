"""Random missions end in one of the answers they may have, and what was planned can be flown.

``MISSIONC_MISSIONS=2000`` compiles so many in the slow test instead of the usual number.
"""

from __future__ import annotations

import os
from typing import assert_never

import numpy as np
import pytest

from missionc.backends.api import Impossible, NotFound
from missionc.base.diagnostics.code import CONTRADICTION, TOO_FAR
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Compiled, InvalidMission, Unverified, Verified
from missionc.output.folder.file_names import file_names
from missionc.verification.verify_plan import verify, verify_polynomials
from tests.support.random_flight_missions import random_mission

FEW = (0, 2, 3, 4, 5, 39, 1023, 1024)
MANY = int(os.environ.get("MISSIONC_MISSIONS", "200"))
PARTS = 4
LIMIT = Seconds(20.0)
"""For one mission: who is not done by then has found nothing, which is an answer too."""


def compiled(seed: int) -> Compiled:
    return driver.compile(Source("random.mission", random_mission(np.random.default_rng(seed))), time_limit=LIMIT)


def answered(seed: int) -> bool:
    """Whether it was planned; nothing but an honest answer comes through."""
    found = compiled(seed)
    said = [f"{each.code.name}: {each.message}" for each in found.findings if not each.code.warning]
    match found.outcome:
        case Verified(plan=plan, files=files, certificate=certificate):
            mission, kernel = found.checked.mission, found.checked.kernel
            assert mission is not None
            assert kernel is not None
            assert certificate.passed
            assert verify(mission, kernel, plan.trace).passed
            written, names = dict(files), file_names(mission.agents)
            flown = {agent.name: written[f"crazyflie/{names[agent.name]}.csv"].decode() for agent in mission.agents}
            assert verify_polynomials(mission, kernel, plan.trace, flown).passed
            assert not any("the mission asks for" in warning for warning in certificate.warnings), certificate.warnings
            return True
        case Impossible() | NotFound():
            return False
        case InvalidMission():
            # What the check alone can prove impossible.
            errors = {each.code for each in found.checked.findings if not each.code.warning}
            assert errors, said
            assert errors <= {TOO_FAR, CONTRADICTION}, said
            return False
        case Unverified():
            raise AssertionError(said)
        case _:
            assert_never(found.outcome)


def test_random_missions_are_planned_and_flown_or_refused_for_a_reason() -> None:
    assert sum(answered(seed) for seed in FEW) >= len(FEW) // 2


@pytest.mark.slow
@pytest.mark.timeout(0)
@pytest.mark.parametrize("part", range(PARTS))
def test_many_random_missions_are_planned_and_flown_or_refused_for_a_reason(part: int) -> None:
    seeds = range(10_000 + part, 10_000 + MANY, PARTS)
    assert sum(answered(seed) for seed in seeds) >= len(seeds) // 2


def test_the_same_seed_draws_the_same_mission() -> None:
    first, again, other = (random_mission(np.random.default_rng(seed)) for seed in (7, 7, 8))
    assert first == again != other
