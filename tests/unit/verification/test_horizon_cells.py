"""What a formula is asked while a mission is flown: at which steps, for how long it is read, in which cells to come."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.ir.kernel.nodes import All, Always, At, Eventually, Is, Node, Until
from missionc.verification.monitoring.live import windows
from missionc.verification.monitoring.live.needed_steps import StepRange, needed_steps, reaches_start
from missionc.verification.monitoring.live.windows import Cells, Columns, cells_after

# -------------------------------------------------------------------- cells


def ends(now: int, last: int, deadlines: tuple[int, ...] = (), spans: tuple[int, ...] = ()) -> list[int]:
    found: list[int] = cells_after(now, last, deadlines, spans).ends.tolist()
    return found


def test_cells_double_and_end_with_the_mission() -> None:
    assert ends(0, 20) == [1, 2, 4, 8, 16, 20]
    assert ends(5, 20) == [6, 7, 9, 13, 20]
    assert ends(19, 20) == [20]
    assert ends(20, 20) == []
    assert ends(0, 16) == [1, 2, 4, 8, 16]


def test_cells_end_at_deadlines_and_where_what_is_asked_always_ends() -> None:
    assert ends(3, 20, deadlines=(2, 3, 10, 14, 20, 25)) == [4, 5, 7, 10, 11, 14, 19, 20]
    assert ends(3, 20, spans=(0, 3, 16, 17, 30)) == [4, 5, 6, 7, 11, 19, 20]


def test_the_nearest_deadlines_alone_end_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(windows, "MOST_DEADLINES", 2)
    assert ends(0, 64, deadlines=(63, 50, 20, 7)) == [1, 2, 4, 7, 8, 16, 20, 32, 64]
    assert ends(0, 64, spans=(63, 50, 20, 7)) == [1, 2, 4, 7, 8, 16, 20, 32, 64]


def test_each_step_is_in_a_cell() -> None:
    cells = cells_after(3, 20, (), ())
    assert (len(cells), cells.ends.tolist(), cells.begins.tolist()) == (6, [4, 5, 7, 11, 19, 20], [4, 5, 6, 8, 12, 20])
    assert cells.of(np.array([1, 4, 5, 6, 7, 8, 20, 25])).tolist() == [0, 0, 1, 2, 2, 3, 5, 5]
    over = Cells(20, np.array([], dtype=np.int64))
    assert (len(over), over.begins.tolist()) == (0, [])


# -------------------------------------------------------------------- asked

A, B = Is(frozenset((0,))), Is(frozenset((1,)))


def asked(root: Node, node: Node, last: int = 10) -> StepRange:
    return needed_steps((root,), last)[node]


@pytest.mark.parametrize(
    ("root", "node", "found"),
    [
        (A, A, StepRange(0, 0, 0)),
        (Always(A, 2, 5), A, StepRange(2, 5, 0, kept=1)),
        (Always(A, 2, None), A, StepRange(2, 10, 0, kept=1)),
        (Always(A, 2, 50), A, StepRange(2, 10, 0, kept=1)),
        (Eventually(Always(A, 1, 2), 3, 4), A, StepRange(4, 6, 0, kept=1)),
        # What is asked after the mission is asked at its last step.
        (Always(A, 12, 15), A, StepRange(10, 10, 0, kept=1)),
        (Until(A, B, 2, 5), A, StepRange(0, 4, 0, kept=1)),
        (Until(A, B, 2, 5), B, StepRange(2, 5, 0, kept=1)),
        (Until(A, B, 2, None), A, StepRange(0, 9, 0, kept=1)),
        (Always(Eventually(A, -3, -1), 0, None), A, StepRange(0, 9, 0, kept=4)),
        (Always(Eventually(A, -20, -1), 0, None), A, StepRange(0, 9, 0, kept=3)),
        (Always(Eventually(A, -20, 0), 0, None), A, StepRange(0, 10, 0, kept=2)),
        (At(1, A), A, StepRange(0, 0, 0)),
    ],
)
def test_an_operand_is_asked_where_the_window_is(root: Node, node: Node, found: StepRange) -> None:
    assert asked(root, node) == found


def test_a_formula_is_final_after_as_many_steps_as_it_looks_ahead() -> None:
    inner = Eventually(A, 1, 3)
    root = Always(inner, 2, 4)
    assert asked(root, root) == StepRange(0, 0, 7)
    assert asked(root, inner) == StepRange(2, 4, 3, kept=4)
    assert asked(root, A) == StepRange(3, 7, 0, kept=1)
    assert asked(root, root, last=5) == StepRange(0, 0, 5)


def test_what_two_ask_is_asked_of_both_and_kept_for_both() -> None:
    both = All((Always(A, 1, 2), Always(Eventually(A, -3, 0), 6, 8)))
    assert asked(both, A) == StepRange(1, 8, 0, kept=4)
    waits = All((Eventually(Until(A, B, 0, 4), 0, 2), A))
    assert asked(waits, A) == StepRange(0, 5, 0, kept=6)
    assert [asked(waits, node).once for node in (waits, A)] == [True, False]


def test_a_window_reaches_the_start_where_it_does_so_wherever_it_is_asked() -> None:
    whole = StepRange(0, 5, 0)
    assert reaches_start(Eventually(A, -5, 0), whole)
    assert reaches_start(Eventually(A, -5, -2), whole)
    assert not reaches_start(Eventually(A, -4, 0), whole)
    assert reaches_start(Until(A, B, -6, 0), whole)
    assert not reaches_start(Until(A, B, -6, -1), whole)


def test_operands_come_first() -> None:
    inner = Eventually(A, 1, 3)
    root = Always(inner, 2, 4)
    assert list(needed_steps((root,), 10)) == [A, inner, root]


# ------------------------------------------------------------------ columns


def filled(columns: Columns, cells: Cells) -> None:
    """Each column has its step's number, a cell's its last one."""
    columns.open(cells.now, len(cells))
    if columns.asked.first <= columns.now <= columns.asked.last:
        columns.part(columns.now, 1, 0)[:] = columns.now
    columns.to_come(len(cells))[:] = cells.ends


def numbers(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[float]:
    """The columns, which are the same in every row."""
    assert values.shape[:2] == (4, 2)
    assert (values == values[:1, :1]).all()
    found: list[float] = values[0, 0].tolist()
    return found


def test_columns_are_kept_as_long_as_they_are_read() -> None:
    columns = Columns(StepRange(2, 40, 3, kept=4), 2)
    for now in range(61):
        cells = cells_after(now, 60, (), ())
        filled(columns, cells)
        known = min(now, 40)
        assert columns.known == known
        assert columns.begin == max(2, now - 3)
        if now < 2:
            assert numbers(columns.part(2, 0, 2)) == cells.ends[:2].tolist()
            continue
        oldest = max(2, known - 4) if now <= 40 else 40
        assert numbers(columns.steps(oldest, known + 1)) == list(range(oldest, known + 1))
        assert numbers(columns.steps(known, known)) == []
        assert numbers(columns.to_come(len(cells))) == cells.ends.tolist()
        if now <= 40:
            first = max(2, now - 3)
            ends = cells.ends.tolist()
            assert numbers(columns.part(first, now - first + 1, len(ends))) == [*range(first, now + 1), *ends]
            assert numbers(columns.part(first, 1, 0)) == [first]
    # Few are held at any time.
    assert columns.values.shape[2] < 50


def test_columns_of_steps_to_come_are_those_of_their_cells() -> None:
    columns = Columns(StepRange(0, 20, 20, kept=20), 2)
    for now in range(4):
        cells = cells_after(now, 20, (), ())
        filled(columns, cells)
    assert numbers(columns.at(np.array([0, 2, 3, 4, 6, 20]), cells)) == [0, 2, 3, 4, 7, 20]
    over = Cells(3, np.array([], dtype=np.int64))
    assert numbers(columns.at(np.array([1, 3]), over)) == [1, 3]
