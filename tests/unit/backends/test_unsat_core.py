"""A core without what it can do without."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import permutations

import numpy as np
import pytest

from missionc.backends.api import Reason
from missionc.backends.smt.refine.lazy_constraints import LazyConstraints
from missionc.backends.smt.refine.problem import minimise
from missionc.backends.smt.sat.solve import Satisfiable, Stopped, Unsatisfiable
from tests.support.legal_plans import mission_of
from tests.support.small_roadmaps import asked, roadmap_of


@contextmanager
def searching(*rows: list[int], seconds: float = 60.0) -> Iterator[tuple[LazyConstraints, list[int]]]:
    """A search in which five literals may be assumed, and clauses over them, numbered from 1."""
    case = asked(mission_of([(0.0, 0.0)], 1), (roadmap_of((0,), [(0.0, 0.0), (1.0, 0.0)], 1),))
    names = case.clauses.fresh(5).tolist()
    for row in rows:
        case.clauses.add(*(np.array([np.sign(each) * names[abs(each) - 1]], dtype=np.int32) for each in row))
    with case.search(seconds=seconds) as search:
        yield search, names


def numbered(core: tuple[int, ...], names: list[int]) -> set[int]:
    return {names.index(literal) + 1 for literal in core}


@pytest.mark.parametrize("order", list(permutations(range(4)))[::5])
def test_what_the_conflict_can_do_without_is_left_out_in_whatever_order_it_comes(order: tuple[int, ...]) -> None:
    with searching([-2, -4]) as (search, names):
        core = minimise(tuple(names[place] for place in order), search)
        assert numbered(core, names) == {2, 4}


def test_of_two_conflicts_one_is_left_whole() -> None:
    with searching([-1, -2], [-3, -4, -5]) as (search, names):
        core = minimise(tuple(names), search)
        assert numbered(core, names) in ({1, 2}, {3, 4, 5})


def test_what_is_left_is_still_impossible_and_without_any_one_of_it_no_longer() -> None:
    with searching([-1, -2, -3], [-3, 4], [-4, -5, -1]) as (search, names):
        core = minimise(tuple(names), search)
        assert isinstance(search.ask(core), Unsatisfiable)
        for left_out in core:
            assert isinstance(search.ask(tuple(other for other in core if other != left_out)), Satisfiable)


def test_a_conflict_of_one_stays_and_so_does_none() -> None:
    with searching([-3]) as (search, names):
        assert minimise((names[2],), search) == (names[2],)
        assert minimise((), search) == ()


def test_without_time_the_core_stays_as_it_is() -> None:
    with searching([-2, -4], seconds=0.0) as (search, names):
        time.sleep(0.01)
        assert minimise(tuple(names), search) == tuple(names)


@pytest.mark.parametrize(("solved", "questions"), [(0.0, 1), (0.4, 1), (2.0, 2), (100.0, 6)])
def test_a_smaller_core_takes_as_much_work_as_the_question_at_most(
    solved: float, questions: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[int, ...]] = []

    def ask(search: LazyConstraints, assumptions: tuple[int, ...], effort: object) -> Stopped:
        asked.append(assumptions)
        search.account.work += 1.5
        return Stopped(Reason.SOLVER, "", paused=True)

    with searching([-2, -4]) as (search, names):
        search.work = solved
        monkeypatch.setattr(LazyConstraints, "ask", ask)
        minimise(tuple(names), search)
        assert len(asked) == questions
