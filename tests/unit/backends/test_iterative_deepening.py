"""Windows that grow: shorter ones imply longer ones, and the last are those that were asked for."""

from __future__ import annotations

from missionc.backends.smt.prioritized.requirement_parts import deepened, within_horizon
from missionc.ir.kernel.nodes import All, Always, At, Eventually, Is, Node, Until, WindowNode

HERE = Is(frozenset((0,)))

FIRST = 16


def _end(formula: Node) -> int | None:
    """The last step of an agent's window."""
    assert isinstance(formula, At)
    assert isinstance(formula.body, WindowNode)
    return formula.body.high


def test_windows_grow_and_end_as_they_were_asked_for() -> None:
    asked: list[Node] = [At(0, Eventually(HERE, 2, 100)), At(1, Always(HERE, 0, None))]
    windows = [[_end(formula) for formula in formulas] for formulas in deepened(asked, 100, FIRST)]
    assert windows == [[2 + FIRST, None], [2 + 2 * FIRST, None], [100, None]]


def test_what_waits_for_nothing_is_asked_for_once() -> None:
    asked: list[Node] = [At(0, Always(Eventually(HERE, 0, 90), 0, 9)), At(0, Eventually(HERE, 0, FIRST))]
    assert list(deepened(asked, 100, FIRST)) == [asked]


def test_a_window_without_end_ends_with_the_mission() -> None:
    formula = All((At(0, Until(HERE, HERE, 1, None)),))
    shorter = within_horizon(formula, FIRST, 100)
    assert isinstance(shorter, All)
    (part,) = shorter.parts
    assert isinstance(part, At)
    assert isinstance(part.body, Until)
    assert (part.body.low, part.body.high) == (1, 1 + FIRST)
    assert within_horizon(formula, 60, 100) is formula
