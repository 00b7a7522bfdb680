"""Clauses as text mean what the clauses mean: read back, and asked of a solver that reads them itself."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import z3
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc.backends.smt.encode.clauses import Clauses, Literals, dimacs, smt2
from tests.support.drat_checker import clauses_of


@st.composite
def lists(draw: st.DrawFn) -> tuple[int, list[list[int]]]:
    """How many variables, and clauses over them."""
    variables = draw(st.sampled_from([1, 2, 3, 9, 10, 99, 100, 12_345]))
    literal = st.integers(1, variables).flatmap(lambda variable: st.sampled_from([variable, -variable]))
    return variables, draw(st.lists(st.lists(literal, min_size=1, max_size=5), min_size=1, max_size=12))


def flat(clauses: list[list[int]]) -> Literals:
    return np.array([literal for clause in clauses for literal in (*clause, 0)], dtype=np.int32)


@given(case=lists())
@settings(max_examples=40)
def test_dimacs_reads_back_as_the_same_clauses(case: tuple[int, list[list[int]]]) -> None:
    variables, clauses = case
    text = dimacs(flat(clauses), variables, len(clauses)).decode()
    assert text.splitlines()[0] == f"p cnf {variables} {len(clauses)}"
    assert clauses_of(text) == clauses


@given(case=lists().filter(lambda case: case[0] <= 3))
@settings(max_examples=40)
def test_both_texts_can_hold_exactly_where_the_clauses_can(case: tuple[int, list[list[int]]]) -> None:
    variables, clauses = case
    can_hold = any(
        all(any(values[abs(literal) - 1] == (literal > 0) for literal in clause) for clause in clauses)
        for values in product([False, True], repeat=variables)
    )
    for text in (smt2(flat(clauses), variables), dimacs(flat(clauses), variables, len(clauses)).decode()):
        solver = z3.Solver()
        solver.from_string(text)
        assert (solver.check() == z3.sat) == can_hold


def test_a_clause_that_nothing_is_left_of_is_written_as_one_that_cannot_hold() -> None:
    clauses = Clauses(10)
    clauses.add(np.array([-1], dtype=np.int32))
    assert clauses_of(dimacs(clauses.everything(), 1, clauses.count).decode()) == [[1], [-1]]


@pytest.mark.parametrize("variables", [7, 100_000])
def test_every_number_stands_apart_from_the_next_however_long(variables: int) -> None:
    clauses = [[variables, -variables], [-1, variables]]
    assert clauses_of(dimacs(flat(clauses), variables, 2).decode()) == clauses
