"""The solver processes: what they answer, why they stop, and that none outlives its run."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from missionc.backends.api import Reason
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.sat import solve
from missionc.backends.smt.sat.solve import Child, Satisfiable, Solvers, Stopped, Unsatisfiable

pytest.importorskip("pysat")

ROOM = 4 << 30


def clauses_of(*rows: list[int], variables: int = 0) -> Clauses:
    clauses = Clauses(10_000_000)
    clauses.fresh(max([variables, *(abs(literal) for row in rows for literal in row)]) - 1)
    for row in rows:
        clauses.add(*(np.array([literal], dtype=np.int32) for literal in row))
    return clauses


def pigeons(holes: int) -> Clauses:
    """One pigeon more than there are holes: nothing a solver of clauses shows soon, where the holes are many."""
    clauses = Clauses(10_000_000)
    nest = clauses.fresh((holes + 1) * holes).reshape(holes + 1, holes)
    clauses.add(nest)
    for one, other in combinations(range(holes + 1), 2):
        clauses.add(-nest[one], -nest[other])
    return clauses


@pytest.fixture(params=["z3", "cadical", "race"])
def solvers(request: pytest.FixtureRequest) -> Iterator[Solvers]:
    with Solvers(request.param, ROOM, 0, time.monotonic() + 120) as started:
        started.begin()
        yield started


def processes(solvers: Solvers) -> list[Child]:
    solvers.start()
    return list(solvers._children)


def gone(child: Child) -> bool:
    """No such process is there any more, not even one that waits to be buried."""
    return child.process.returncode is not None and not Path(f"/proc/{child.process.pid}").exists()


def test_a_model_satisfies_every_clause(solvers: Solvers) -> None:
    rows = [[2, 3], [-2, 4], [-3, -4], [5, -2], [-5, 3, 4]]
    solvers.add(clauses_of(*rows))
    assert isinstance(solvers.solve((2,)), Satisfiable)
    values = solvers.values(np.arange(1, 6, dtype=np.int32))
    assert isinstance(values, np.ndarray)
    assert values[1], "what is assumed holds"
    assert all(any(values[abs(literal) - 1] == (literal > 0) for literal in row) for row in rows)


def test_a_refusal_rests_on_assumptions_that_are_enough_for_it(solvers: Solvers) -> None:
    solvers.add(clauses_of([-2, -3], variables=6))
    answer = solvers.solve((4, 2, 5, 3, -6))
    assert isinstance(answer, Unsatisfiable)
    assert set(answer.core) >= {2, 3}
    again = solvers.solve(answer.core)
    assert isinstance(again, Unsatisfiable)
    assert isinstance(solvers.solve((4, 2, 5)), Satisfiable)


def test_clauses_that_cannot_hold_are_refused_whatever_is_assumed(solvers: Solvers) -> None:
    solvers.add(clauses_of([2], [-2], variables=3))
    answer = solvers.solve((3,))
    assert isinstance(answer, Unsatisfiable)
    assert answer.core == ()


def test_clauses_that_come_later_count_too_and_only_they_are_sent(solvers: Solvers) -> None:
    clauses = clauses_of([2, 3], variables=3)
    solvers.add(clauses)
    assert isinstance(solvers.solve((-2,)), Satisfiable)
    clauses.add(np.array([-3], dtype=np.int32))
    solvers.add(clauses)
    assert all(clauses.since(child.told)[0].size == 0 for child in solvers._children)
    assert isinstance(solvers.solve((-2,)), Unsatisfiable)


def test_a_new_problem_forgets_the_clauses_of_the_one_before(solvers: Solvers) -> None:
    solvers.add(clauses_of([2], variables=2))
    assert isinstance(solvers.solve((-2,)), Unsatisfiable)
    solvers.begin()
    solvers.add(clauses_of([2, 3], variables=3))
    assert isinstance(solvers.solve((-2,)), Satisfiable)


def test_many_clauses_at_once_and_one_by_one_are_the_same_problem(solvers: Solvers) -> None:
    chain = [[-number, number + 1] for number in range(2, 600)]
    solvers.add(clauses_of(*chain))
    assert isinstance(solvers.solve((2, -600)), Unsatisfiable)
    solvers.begin()
    clauses = clauses_of(variables=600)
    for row in chain[::40]:
        clauses.add(*(np.array([literal], dtype=np.int32) for literal in row))
        solvers.add(clauses)
    assert isinstance(solvers.solve((2, -600)), Satisfiable)


@pytest.mark.parametrize("solver", ["z3", "cadical", "race"])
def test_the_time_limit_is_said_and_leaves_no_process(solver: str) -> None:
    with Solvers(solver, ROOM, 0, time.monotonic() + 1) as solvers:
        children = processes(solvers)
        solvers.begin()
        solvers.add(pigeons(14))
        answer = solvers.solve(())
        assert answer == Stopped(Reason.TIME, "")
        assert not solvers.alive
        assert all(map(gone, children))


def test_one_question_may_have_a_limit_of_its_own_that_ends_the_solver() -> None:
    with Solvers("z3", ROOM, 0, time.monotonic() + 300) as solvers:
        solvers.begin()
        solvers.add(pigeons(14))
        assert solvers.solve((), time.monotonic() + 0.5) == Stopped(Reason.TIME, "")
        assert solvers.solve(()) == Stopped(Reason.SOLVER, "no solver is left")


@pytest.mark.parametrize("solver", ["z3", "cadical"])
@pytest.mark.parametrize("megabytes", [20, 90])
def test_memory_that_runs_out_is_said_so_whether_at_the_start_or_at_work(solver: str, megabytes: int) -> None:
    with Solvers(solver, megabytes << 20, 0, time.monotonic() + 100) as solvers:
        children = processes(solvers)
        solvers.begin()
        solvers.add(pigeons(90))
        answer = solvers.solve(())
        assert isinstance(answer, Stopped)
        assert answer.reason is Reason.MEMORY
    assert all(map(gone, children))


def test_a_solver_that_dies_is_no_answer() -> None:
    with Solvers("z3", ROOM, 0, time.monotonic() + 60) as solvers:
        (child,) = processes(solvers)
        solvers.begin()
        solvers.add(pigeons(14))
        os.kill(child.process.pid, signal.SIGTERM)
        assert solvers.solve(()) == Stopped(Reason.SOLVER, f"the solver ended with status {-signal.SIGTERM}")
        assert gone(child)


def test_of_two_solvers_one_may_die_and_the_other_answers() -> None:
    with Solvers("race", ROOM, 0, time.monotonic() + 60) as solvers:
        dead, _ = processes(solvers)
        os.kill(dead.process.pid, signal.SIGKILL)
        solvers.begin()
        solvers.add(pigeons(5))
        assert isinstance(solvers.solve(()), Unsatisfiable)
        assert solvers.names == ("cadical",)
        assert gone(dead)


def test_of_two_solvers_the_first_that_answers_is_kept_and_the_other_ends() -> None:
    with Solvers("race", ROOM, 0, time.monotonic() + 60) as solvers:
        children = processes(solvers)
        solvers.begin()
        solvers.add(clauses_of([2, 3]))
        assert isinstance(solvers.solve(()), Satisfiable)
        (kept,) = processes(solvers)
        assert [gone(child) for child in children] == [child is not kept for child in children]
    assert all(map(gone, children))


def test_an_exception_at_any_time_leaves_no_process() -> None:
    solvers = Solvers("race", ROOM, 0, time.monotonic() + 60)
    children = processes(solvers)

    def interrupted() -> None:
        with solvers:
            solvers.begin()
            solvers.add(pigeons(14))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert all(map(gone, children))


def test_how_much_memory_a_solver_held_is_known_when_it_is_gone() -> None:
    with Solvers("z3", ROOM, 0, time.monotonic() + 60) as solvers:
        solvers.begin()
        solvers.add(clauses_of([2, 3]))
        solvers.solve(())
    assert 10 << 20 < solvers.peak_bytes < ROOM


# ------------------------------------------------------------------------ glances


@pytest.fixture
def glancing() -> Iterator[Solvers]:
    with Solvers("z3", ROOM, 0, time.monotonic() + 60) as made:
        made.begin()
        yield made


def test_a_glance_gives_a_model_and_starts_no_child(glancing: Solvers) -> None:
    rows = [[2, 3], [-2, 4], [-3, -4], [5, -2], [-5, 3, 4]]
    model = glancing.presolve(clauses_of(*rows), (2,))
    assert isinstance(model, np.ndarray)
    assert model.shape == (6,)
    assert model[1]
    assert model[2]
    assert all(any(model[abs(literal)] == (literal > 0) for literal in row) for row in rows)
    assert not glancing._children
    assert glancing.alive
    assert 0 <= glancing.peak_bytes < ROOM, "of a library that was loaded before, next to nothing is new"


def test_a_glance_reads_clauses_as_they_are_made_and_each_sees_all_of_them(glancing: Solvers) -> None:
    clauses = clauses_of([2, 3], variables=4)
    glancing.show(clauses)
    clauses.add(np.array([-2], dtype=np.int32))
    model = glancing.presolve(clauses, ())
    assert isinstance(model, np.ndarray)
    assert not model[2]
    assert model[3]
    clauses.add(np.array([-3], dtype=np.int32))
    assert isinstance(glancing.presolve(clauses, ()), Unsatisfiable)
    glancing.begin()
    assert isinstance(glancing.presolve(clauses_of([2], variables=2), ()), np.ndarray)


def test_a_refusal_at_a_glance_rests_on_all_that_was_assumed(glancing: Solvers) -> None:
    assert glancing.presolve(clauses_of([-2, -3], variables=6), (4, 2, 3)) == Unsatisfiable((4, 2, 3))


def test_what_is_hard_is_not_settled_at_a_glance(glancing: Solvers) -> None:
    assert glancing.presolve(pigeons(14), ()) is None


def test_the_same_seed_gives_the_same_model_at_a_glance(glancing: Solvers) -> None:
    clauses = clauses_of(*([number, number + 1, -number - 2] for number in range(2, 300)), variables=302)
    one, other = glancing.presolve(clauses, ()), glancing.presolve(clauses, ())
    assert isinstance(one, np.ndarray)
    assert isinstance(other, np.ndarray)
    assert (one == other).all()


def test_a_glance_ends_with_the_time_and_leaves_no_process() -> None:
    with Solvers("z3", ROOM, 0, time.monotonic() + 1, presolve=10**9) as solvers:
        solvers.begin()
        process = solvers._presolver.process if solvers._presolver else None
        assert solvers.presolve(pigeons(14), ()) is None
    assert process is not None
    assert process.returncode is not None
    assert not Path(f"/proc/{process.pid}").exists()


def test_cadical_alone_takes_no_glance_and_neither_does_a_z3_without_its_program(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with Solvers("cadical", ROOM, 0, time.monotonic() + 60) as solvers:
        assert solvers.presolve(clauses_of([2, 3]), ()) is None
    monkeypatch.setattr("missionc.backends.smt.sat.solve.program", lambda folder: None)
    with Solvers("z3", ROOM, 0, time.monotonic() + 60) as solvers:
        solvers.begin()
        assert solvers.presolve(clauses_of([2, 3]), ()) is None
        solvers.add(clauses_of([2, 3]))
        assert isinstance(solvers.solve(()), Satisfiable)


def test_two_solvers_take_turns_and_each_goes_on_with_what_it_knows() -> None:
    clauses = pigeons(7)
    with Solvers("auto", ROOM, 0, time.monotonic() + 60) as solvers:
        assert solvers.takes_turns
        asked, before = [], 0
        for turn in range(12):
            solvers.add(clauses)
            asked.append((solvers.names, clauses.since(solvers._children[0].told)[0].size))
            answer = solvers.solve((), conflicts=100 * 2**turn)
            if not (isinstance(answer, Stopped) and answer.paused):
                break
            assert solvers.conflicts > before
            before = solvers.conflicts
            solvers.relieve()
        assert isinstance(answer, Unsatisfiable)
        assert asked[:3] == [(("z3",), 0), (("cadical",), 0), (("z3",), 0)]


def test_a_solver_whose_limit_is_lifted_answers() -> None:
    clauses = pigeons(6)
    with Solvers("z3", ROOM, 0, time.monotonic() + 60) as solvers:
        solvers.add(clauses)
        answer = solvers.solve((), conflicts=3)
        assert isinstance(answer, Stopped)
        assert answer.paused
        assert isinstance(solvers.solve(()), Unsatisfiable)


def test_without_cadical_z3_is_asked_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = solve.package_folder
    monkeypatch.setattr(solve, "package_folder", lambda package: "" if package == "pysat" else folder(package))
    with Solvers("auto", ROOM, 0, time.monotonic() + 60) as solvers:
        assert not solvers.takes_turns
        solvers.add(clauses_of([2]))
        solvers.relieve()
        assert solvers.names == ("z3",)
