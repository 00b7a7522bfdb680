"""Clauses of a refutation, each list of them written out; and what counts of them are worth, tried by hand."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import pytest

from missionc.verification.impossibility import cnf as module
from missionc.verification.impossibility.cnf import FALSE, TRUE, Cnf, TooManyClauses

pysat = pytest.importorskip("pysat.solvers")


def made(variables: int = 0) -> Cnf:
    """With so many variables, from 2 on."""
    cnf = Cnf()
    for _ in range(variables):
        cnf.fresh()
    return cnf


def allows(cnf: Cnf, *literals: int) -> bool:
    """Whether some assignment of all variables satisfies all clauses and has these literals."""
    with pysat.Solver(name="cadical153", bootstrap_with=cnf.clauses) as solver:
        return bool(solver.solve(assumptions=literals))


def test_the_first_variable_is_true() -> None:
    cnf = made()
    assert cnf.clauses == [[1]]
    assert [cnf.fresh(), cnf.fresh(), cnf.variables] == [2, 3, 3]
    assert (TRUE, FALSE) == (1, -1)


def test_what_is_known_folds_away() -> None:
    cnf = made(2)
    cnf.add((2, FALSE, -3))
    cnf.add((2, TRUE))
    cnf.add((FALSE,))
    cnf.add(())
    assert cnf.clauses == [[1], [2, -3], [-1], [-1]]


def test_a_name_implies_each_of_all_and_one_of_some() -> None:
    cnf = made(2)
    assert cnf.all_of((2, 3, 2, TRUE)) == 4
    assert cnf.any_of((2, -3, FALSE, -3)) == 5
    assert cnf.clauses == [[1], [-4, 2], [-4, 3], [-5, 2, -3]]


def test_one_alone_or_none_needs_no_name() -> None:
    cnf = made(2)
    assert [cnf.all_of(()), cnf.all_of((TRUE,)), cnf.all_of((2,)), cnf.all_of((2, 2, TRUE))] == [TRUE, TRUE, 2, 2]
    assert cnf.all_of((2, 3, FALSE)) == FALSE
    assert [cnf.any_of(()), cnf.any_of((FALSE,)), cnf.any_of((2,)), cnf.any_of((2, 2, FALSE))] == [FALSE, FALSE, 2, 2]
    assert cnf.any_of((2, 3, TRUE)) == TRUE
    assert (cnf.clauses, cnf.variables) == ([[1]], 3)


@pytest.mark.parametrize("count", range(6))
def test_so_many_hold_where_their_literal_does(count: int) -> None:
    cnf = made(4)
    name = cnf.at_least(count, (2, 3, 4, 5))
    for signs in product((1, -1), repeat=4):
        chosen = [sign * literal for sign, literal in zip(signs, (2, 3, 4, 5), strict=True)]
        assert allows(cnf, name, *chosen) == (signs.count(1) >= count)


def test_none_or_fewer_of_them_always_hold_and_more_than_there_are_never() -> None:
    cnf = made(2)
    assert [cnf.at_least(0, (2, 3)), cnf.at_least(-1, (2, 3)), cnf.at_least(3, (2, 3))] == [TRUE, TRUE, FALSE]
    assert cnf.at_least(1, (2,)) == 2


@pytest.mark.parametrize("literals", [(2, 3, 4), (-2, 3, FALSE, -4), (2,), ()])
def test_no_two_hold(literals: Sequence[int]) -> None:
    cnf = made(3)
    cnf.at_most_one(literals)
    some = [literal for literal in literals if literal != FALSE]
    for signs in product((1, -1), repeat=len(some)):
        chosen = [sign * literal for sign, literal in zip(signs, some, strict=True)]
        assert allows(cnf, *chosen) == (signs.count(1) <= 1)


def test_a_file_counts_variables_and_clauses() -> None:
    cnf = made(2)
    cnf.add((2, -3))
    assert cnf.dimacs() == b"p cnf 3 2\n1 0\n2 -3 0\n"


def test_there_are_no_more_clauses_than_anybody_goes_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_CLAUSES", 2)
    cnf = made(2)
    cnf.add((2, 3))
    with pytest.raises(TooManyClauses, match="there are more than 2 clauses"):
        cnf.add((-2,))
    assert len(cnf.clauses) == 2
