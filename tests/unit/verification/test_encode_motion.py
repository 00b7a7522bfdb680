"""Clauses of where agents are, over two or three cells: which motions from cell to cell they leave."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from missionc.base.trace import Flags
from missionc.verification.impossibility.cnf import FALSE, TRUE, Cnf
from missionc.verification.impossibility.cover_document import CellsOfKind, ClaimedCover
from missionc.verification.impossibility.encode_formulas import add_support, encode_motion, within_box

pysat = pytest.importorskip("pysat.solvers")

Motion = tuple[int, ...]

NOWHERE = (np.zeros((0, 1)), np.zeros((0, 1)))


def flags(shape: tuple[int, ...], *where: tuple[int, ...]) -> Flags:
    found = np.zeros(shape, dtype=np.bool_)
    for each in where:
        found[each] = True
    return found


def cover(cells: int, steps: int, agents: int = 1) -> ClaimedCover:
    """Cells of a metre beside each other, in which everybody may be at all steps."""
    begin = np.arange(cells, dtype=np.float64)[:, None]
    kind = CellsOfKind(tuple(range(agents)), (begin, begin + 1), 0, NOWHERE, {}, {})
    absent = {agent: flags((steps + 1, cells)) for agent in range(agents)}
    return ClaimedCover((), tuple(range(agents)), True, (kind,), {}, absent, {}, (), {}, ())


def with_kind(claimed: ClaimedCover, **changes: object) -> ClaimedCover:
    return replace(claimed, kinds=(replace(claimed.kinds[0], **changes),))  # type: ignore[arg-type]


def left(claimed: ClaimedCover) -> set[tuple[Motion, ...]]:
    """The joint motions, of each agent its cells step by step, that the clauses leave."""
    cnf = Cnf()
    states = encode_motion(claimed, cnf)
    cells, steps = len(claimed.kinds[0]), len(claimed.absent[0])
    found = set()
    with pysat.Solver(name="cadical153", bootstrap_with=cnf.clauses) as solver:
        for each in product(product(range(cells), repeat=steps), repeat=len(claimed.asked)):
            wanted = [
                int(states[agent][step, cell])
                for agent, motion in zip(claimed.asked, each, strict=True)
                for step, cell in enumerate(motion)
            ]
            if FALSE not in wanted and solver.solve(assumptions=wanted):
                found.add(each)
    return found


def motions(claimed: ClaimedCover, keep: Callable[[tuple[Motion, ...]], bool]) -> set[tuple[Motion, ...]]:
    cells, steps = len(claimed.kinds[0]), len(claimed.absent[0])
    return {each for each in product(product(range(cells), repeat=steps), repeat=len(claimed.asked)) if keep(each)}


def test_everybody_is_in_one_cell_at_each_step_where_it_may_be() -> None:
    claimed = cover(3, 1)
    assert left(claimed) == motions(claimed, lambda each: True)
    cnf = Cnf()
    states = encode_motion(claimed, cnf)
    with pysat.Solver(name="cadical153", bootstrap_with=cnf.clauses) as solver:
        for row in states[0].tolist():
            assert not solver.solve(assumptions=[-literal for literal in row])
            assert not solver.solve(assumptions=row[:2])
    away = replace(claimed, absent={0: flags((2, 3), (0, 1), (1, 0))})
    assert left(away) == motions(claimed, lambda each: each[0][0] != 1 and each[0][1] != 0)
    assert encode_motion(away, Cnf())[0][0, 1] == FALSE


@pytest.mark.parametrize("steps", [1, 2])
def test_no_motion_does_in_so_many_steps_what_none_does(steps: int) -> None:
    never = flags((3, 3), (0, 2), (1, 1))
    claimed = with_kind(cover(3, 3), no_move={steps: never})

    def moves(each: tuple[Motion, ...]) -> bool:
        return not any(never[here, there] for here, there in zip(each[0], each[0][steps:], strict=False))

    assert left(claimed) == motions(claimed, moves)


@pytest.mark.parametrize("steps", [1, 2])
def test_no_motion_bends_as_none_does(steps: int) -> None:
    never = flags((2, 2, 2), (0, 1, 0), (1, 1, 0))
    claimed = with_kind(cover(2, 4), no_turn={steps: never})

    def bends(each: tuple[Motion, ...]) -> bool:
        (own,) = each
        return not any(never[own[begin], own[begin + steps], own[begin + 2 * steps]] for begin in range(5 - 2 * steps))

    assert left(claimed) == motions(claimed, bends)


def test_nobody_is_ever_in_both_of_two_cells() -> None:
    claimed = replace(cover(3, 2), not_both={0: flags((3, 3), (2, 0), (1, 1))})
    assert left(claimed) == motions(claimed, lambda each: not {0, 2} <= set(each[0]) and 1 not in each[0])


def test_two_are_never_in_two_cells_at_a_time_where_bodies_keep_apart() -> None:
    claimed = replace(cover(2, 1, 2), not_together={(0, 1): flags((2, 2), (0, 0), (1, 0))})

    def apart(each: tuple[Motion, ...]) -> bool:
        return all(pair not in ((0, 0), (1, 0)) for pair in zip(*each, strict=True))

    assert left(claimed) == motions(claimed, apart)
    assert left(replace(claimed, apart=False)) == motions(claimed, lambda each: True)


def test_no_more_are_in_a_box_at_a_time_than_fit() -> None:
    room = np.array([0.0]), np.array([2.0])
    claimed = replace(cover(3, 0, 3), at_most=((*room, 1),))
    assert left(claimed) == motions(claimed, lambda each: sum(own[0] < 2 for own in each) <= 1)
    assert left(replace(claimed, at_most=((*room, 2),))) == motions(
        claimed, lambda each: any(own[0] == 2 for own in each)
    )
    assert left(replace(claimed, apart=False)) == motions(claimed, lambda each: True)
    longer = replace(cover(2, 1, 2), at_most=((np.array([0.0]), np.array([1.0]), 1),))
    assert left(longer) == motions(longer, lambda each: all(pair != (0, 0) for pair in zip(*each, strict=True)))


def test_a_cell_lies_in_a_box_up_to_its_sides() -> None:
    (kind,) = cover(4, 0).kinds
    assert within_box(kind, np.array([1.0]), np.array([3.0])).tolist() == [False, True, True, False]
    assert within_box(kind, np.array([1.5]), np.array([3.5])).tolist() == [False, False, True, False]


def test_who_is_not_asked_is_nowhere() -> None:
    claimed = replace(cover(2, 0, 2), asked=(1,), not_both={0: flags((2, 2), (0, 0))})
    claimed = replace(claimed, not_together={(0, 1): flags((2, 2), (0, 0))})
    assert list(encode_motion(claimed, Cnf())) == [1]


def clauses(ruled_out: Iterable[int], cells: int, condition: int = FALSE) -> list[list[int]]:
    """What is said of a cell with the literal 2 and of others, from 3 on."""
    cnf = Cnf()
    fits = np.ones((2, cells), dtype=np.bool_)
    fits[0, list(ruled_out)] = False
    there = np.arange(3, 3 + cells)
    there[1] = FALSE
    add_support(cnf, np.array([2, FALSE]), there, fits, condition)
    return cnf.clauses[1:]


def test_few_cells_are_ruled_out_one_by_one_and_many_by_those_that_are_left() -> None:
    assert clauses((), 8) == []
    assert clauses((0, 1, 2), 8) == [[-2, -3], [-2, -5]]
    assert clauses((0, 2, 3, 4), 8) == [[-2, -3], [-2, -5], [-2, -6], [-2, -7]]
    assert clauses((0, 2, 3, 4, 5), 8) == [[-2, 9, 10]]
    assert clauses((0, 2), 8, condition=-9) == [[-9, -2, -3], [-9, -2, -5]]
    assert clauses((0, 2, 3, 4, 5), 8, condition=-9) == [[-9, -2, 9, 10]]
    assert clauses((0, 2), 8, condition=TRUE) == []
