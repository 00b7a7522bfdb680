"""What a certificate says of covers is so: motions at random, with missions that they are plans of.

Every claim of the maker's passes the checks, which share nothing with it; and the clauses hold of the cells that a plan
goes through, so that no proof of them refuses it.
"""

from __future__ import annotations

import random
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from missionc.backends.api import Budget
from missionc.backends.cover.cover import build_cover
from missionc.backends.cover.may_labels import relaxed
from missionc.backends.cover.motion_caps import motion_caps
from missionc.backends.cover.refute import Question
from missionc.backends.run_account import Account
from missionc.backends.smt.sat.solve import Solvers
from missionc.compiler.claim_cover import claimed
from missionc.verification.impossibility.check_motion import inflated
from missionc.verification.impossibility.check_refutation import check_cover
from missionc.verification.impossibility.cnf import Cnf
from missionc.verification.impossibility.cover_document import ClaimedCover, document, read_cover
from missionc.verification.impossibility.encode_formulas import encode_motion
from tests.support.motions_with_missions import Planned, on_a_grid, under_way

pysat = pytest.importorskip("pysat.solvers")

FEW = settings(
    max_examples=20, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much], deadline=None
)


def cover_of(planned: Planned, cells: int, alone: bool) -> ClaimedCover:
    """What covers leave out of all that is asked of a mission."""
    mission, kernel = planned.mission, planned.kernel
    caps = motion_caps(mission, kernel)
    cover = build_cover(caps.mission, relaxed(mission, kernel), cells)
    together = frozenset[int]() if alone else frozenset(range(len(mission.agents)))
    budget = Budget(time.monotonic() + 60)
    with Solvers("auto", budget.memory_bytes, 0, budget.deadline, presolve=0) as solvers:
        question = Question(caps, cover, kernel.requirements, together, budget, Account(), solvers)
        return claimed(question, tuple(goal.name for goal in kernel.requirements), mission, kernel)[0]


def way(planned: Planned, cover: ClaimedCover, draw: random.Random) -> list[int]:
    """The literals of cells that a plan goes through; where several hold a place, of any one of them."""
    states, literals = encode_motion(cover, Cnf()), []
    for agent, own in states.items():
        low, high = inflated(cover.kind_of(agent))
        for place, literal, absent in zip(planned.trace.position[agent], own, cover.absent[agent], strict=True):
            inside = np.flatnonzero(np.all((low <= place) & (place <= high), axis=1) & ~absent)
            assert inside.size, f"no cell contains {place}"
            literals.append(int(literal[draw.choice(inside.tolist())]))
    return literals


def holds(planned: Planned, cells: int, alone: bool, draw: random.Random) -> None:
    made = cover_of(planned, cells, alone)
    cover = read_cover(document(made, planned.mission).decode(), planned.mission)
    checks, clauses = check_cover(planned.mission, planned.kernel, cover)
    assert not [each for each in checks if not each.passed]
    with pysat.Cadical195(bootstrap_with=clauses.clauses) as solver:
        assert solver.solve(assumptions=way(planned, cover, draw))


@FEW
@given(on_a_grid(), st.booleans(), st.randoms(use_true_random=False))
def test_claims_about_a_motion_on_a_grid_hold(planned: Planned, alone: bool, draw: random.Random) -> None:
    holds(planned, 12, alone, draw)


@FEW
@given(under_way(), st.booleans(), st.randoms(use_true_random=False))
def test_claims_about_a_motion_at_its_bounds_hold(planned: Planned, alone: bool, draw: random.Random) -> None:
    holds(planned, 40, alone, draw)
