"""Nothing that is claimed of a mission with a plan, and passes the checks, contradicts the plan.

Covers are not those of the maker: cells lie at random, and everything is claimed that the checks let pass.
"""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from missionc.verification.impossibility.check_motion import inflated
from missionc.verification.impossibility.check_refutation import check_cover
from missionc.verification.impossibility.cnf import FALSE, Cnf
from missionc.verification.impossibility.cover_document import ClaimedCover, document, read_cover
from missionc.verification.impossibility.encode_formulas import encode_motion
from missionc.verification.verify_plan import verify
from tests.support.forged_covers import boldest
from tests.support.motions_with_missions import Planned, on_a_grid, under_way

pysat = pytest.importorskip("pysat.solvers")

FEW = settings(
    max_examples=10, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much], deadline=None
)


def ways(planned: Planned, cover: ClaimedCover) -> list[list[int]]:
    """For each agent and step, the literals of the cells that hold its place."""
    found = []
    for agent, own in encode_motion(cover, Cnf()).items():
        low, high = inflated(cover.kind_of(agent))
        for place, literals in zip(planned.trace.position[agent], own, strict=True):
            inside = np.all((low <= place) & (place <= high), axis=1) & (literals != FALSE)
            found.append(literals[inside].tolist())
    return found


def stands(planned: Planned, cells: int, draw: random.Random) -> None:
    """A plan is among the motions that the boldest cover leaves."""
    mission, kernel = planned.mission, planned.kernel
    made = boldest(mission, kernel, cells, draw)
    cover = read_cover(document(made, mission).decode(), mission)
    checks, clauses = check_cover(mission, kernel, cover)
    assert not [each for each in checks if not each.passed]
    with pysat.Cadical195(bootstrap_with=[*clauses.clauses, *ways(planned, cover)]) as solver:
        assert solver.solve()


@FEW
@given(on_a_grid(), st.integers(1, 8), st.randoms(use_true_random=False))
def test_no_forged_cover_refuses_a_motion_on_a_grid(planned: Planned, cells: int, draw: random.Random) -> None:
    assert verify(planned.mission, planned.kernel, planned.trace).passed
    stands(planned, cells, draw)


@FEW
@given(under_way(), st.integers(1, 8), st.randoms(use_true_random=False))
def test_no_forged_cover_refuses_a_motion_at_its_bounds(planned: Planned, cells: int, draw: random.Random) -> None:
    assert verify(planned.mission, planned.kernel, planned.trace).passed
    stands(planned, cells, draw)
