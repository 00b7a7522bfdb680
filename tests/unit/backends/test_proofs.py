"""What `--certify` leaves of roadmaps is a proof: checked step by step, by code that knows nothing of its maker."""

from __future__ import annotations

import time
from functools import cache

import numpy as np
import pytest

import missionc
from missionc.backends.api import Budget, Impossible
from missionc.backends.options import Options
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.sat.proof import Unproved, prove
from missionc.base.source import Source
from missionc.compiler.results import Verified
from tests.support.drat_checker import clauses_of, fault
from tests.support.small_missions import CONFLICT, SMALL

pytest.importorskip("pysat")
pytestmark = pytest.mark.usefixtures("roadmaps_alone")

NO_WAY = (
    SMALL.replace("horizon 6 s", "horizon 1 s")
    .replace("start    in base", "start in base  finish in goal")
    .replace("eventually[0, 6 s]", "eventually[0, 1 s]")
)
"""Too short to come from base to goal: refused whatever is required."""

CROWD = """\
mission crowd
time step 1 s, horizon 3 s
world (0, 0) to (6, 1)
region left = box (0, 0) to (1.5, 1)
region right = box (4.5, 0) to (6, 1)
team a[3] { radius 0.25 m dynamics single_integrator(speed <= 2 m/s) start in left finish in right }
team b[3] { radius 0.25 m dynamics single_integrator(speed <= 2 m/s) start in right finish in left }
separation 0.2 m
solve with smt { nodes = 20 }
require meet: some a: eventually[0, 3 s] right
require swap: some b: eventually[0, 3 s] left
"""
"""Two teams that cannot pass each other in a corridor: refused for the collisions."""

MISSIONS = {"conflict": CONFLICT.replace("nodes = 40", "nodes = 14"), "no_way": NO_WAY, "crowd": CROWD}


@cache
def certified(name: str) -> tuple[str, str, tuple[str, ...]]:
    """The CNF, the proof, and the requirements in conflict."""
    outcome = missionc.compile(Source(f"{name}.mission", MISSIONS[name]), options=Options(certify=True)).outcome
    assert isinstance(outcome, Impossible)
    files = {name: content.decode() for name, content in outcome.report.files}
    return files["impossible.cnf"], files["impossible.drat"], outcome.conflict


@pytest.mark.parametrize("name", MISSIONS)
def test_every_step_of_a_proof_follows_from_those_before_it(name: str) -> None:
    cnf, drat, _ = certified(name)
    assert fault(cnf, drat) == ""


def test_a_proof_without_its_lemmas_is_refused() -> None:
    cnf, _, _ = certified("conflict")
    assert fault(cnf, "0\n") == "line 1 does not follow"


def test_a_proof_cut_short_is_refused() -> None:
    cnf, drat, _ = certified("conflict")
    lines = drat.splitlines()
    assert fault(cnf, "\n".join(lines[: lines.index("0")])) == "the proof never comes to the empty clause"


def test_a_proof_with_a_lemma_turned_into_its_opposite_is_refused() -> None:
    cnf, drat, _ = certified("conflict")
    lines = drat.splitlines()
    unit = next(number for number, line in enumerate(lines) if len(line.split()) == 2)
    lines[unit] = lines[unit][1:] if lines[unit].startswith("-") else f"-{lines[unit]}"
    assert fault(cnf, "\n".join(lines)) == f"line {unit + 1} does not follow"


@pytest.mark.parametrize("name", MISSIONS)
def test_a_proof_is_no_proof_of_clauses_that_can_hold(name: str) -> None:
    outcome = missionc.compile(Source("a.mission", SMALL), options=Options(captures=frozenset({"dimacs"}))).outcome
    assert isinstance(outcome, Verified)
    assert fault(dict(outcome.report.texts)["dimacs"], certified(name)[1]).endswith("does not follow")


def test_without_any_one_of_the_requirements_in_conflict_nothing_is_proved() -> None:
    cnf, drat, conflict = certified("conflict")
    clauses = clauses_of(cnf)
    assert all(len(clause) == 1 for clause in clauses[-len(conflict) :])
    for left_out in range(len(clauses) - len(conflict), len(clauses)):
        fewer = written([clause for number, clause in enumerate(clauses) if number != left_out])
        assert fault(fewer, drat).endswith("does not follow")


def given(flat: list[int]) -> Clauses:
    clauses = Clauses(100)
    clauses.fresh(2)
    clauses.add(*(np.array([literal], dtype=np.int32) for literal in flat))
    return clauses


def test_what_another_solver_refused_and_this_one_has_a_model_of_is_a_defect_and_not_an_answer() -> None:
    with pytest.raises(RuntimeError, match="disagree"):
        prove(given([2, 3]), (2,), Budget(time.monotonic() + 60))


def test_a_proof_that_the_memory_has_no_room_for_is_none_and_says_so() -> None:
    result = prove(given([2, 3]), (-2, -3), Budget(time.monotonic() + 60, memory_bytes=20 << 20))
    assert isinstance(result, Unproved)
    assert "memory" in result.statement


# --------------------------------------------------- the checker itself

SQUARE = [[1, 2], [-1, 2], [1, -2], [-1, -2]]


def written(clauses: list[list[int]]) -> str:
    most = max(abs(literal) for clause in clauses for literal in clause)
    return "\n".join([f"p cnf {most} {len(clauses)}", *(" ".join(map(str, [*clause, 0])) for clause in clauses)])


def test_what_follows_by_unit_propagation_may_be_added_and_dropped() -> None:
    assert fault(written(SQUARE), "2 0\nd 1 2 0\n0") == ""


def test_what_needs_a_dropped_clause_no_longer_follows() -> None:
    assert fault(written(SQUARE), "d 1 2 0\n2 0\n0") == "line 2 does not follow"


def test_a_clause_given_twice_is_still_there_when_dropped_once() -> None:
    assert fault(written([*SQUARE, [1, 2]]), "d 1 2 0\n2 0\n0") == ""


def test_a_definition_may_be_added_upon_its_first_literal_and_upon_no_other() -> None:
    assert fault(written([[1, 2]]), "3 -1 0\n3 -2 0\n") == "the proof never comes to the empty clause"
    assert fault(written([[1, 2]]), "-1 3 0\n") == "line 1 does not follow"


def test_clauses_that_can_hold_have_no_proof() -> None:
    assert fault(written(SQUARE[:3]), "2 0\n1 0\n0").endswith("does not follow")


def test_a_header_that_miscounts_is_refused() -> None:
    assert fault("p cnf 2 3\n1 0\n-1 0\n", "0\n") == "the header promises other clauses"
    assert fault("p cnf 2 2\n3 0\n-3 0\n", "0\n") == "the header promises other clauses"
