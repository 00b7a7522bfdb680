"""How far kernel formulas look ahead, against what the formulas that they came from need."""

from __future__ import annotations

import pytest
from hypothesis import given, settings

from missionc import ir
from missionc.ir.kernel.analysis import helped_by_more, relevance, remembering, steps_ahead
from missionc.ir.kernel.nodes import All, Any, At, Atom, Eventually, EveryNeighbour, Is, Neighbour, Node, Not, Until
from missionc.ir.lower.expand import expand
from tests import reference
from tests.support.random_runs import FIELD, SPAN, Case, cases, flags_of, graphs_of, mission_of

LAST = 4
WINDOWS = [(0, 0), (0, 1), (0, None), (1, 1), (1, 3), (1, None), (2, 9), (4, None), (5, 6), (-2, 0), (-3, -1)]


def local(formula: ir.Formula) -> bool:
    """Whether it has no spatial operator, and no loss of agents, which may leave an operand out."""
    match formula:
        case ir.Apply(operator, operands):
            return not operator.spatial and all(map(local, operands))
        case ir.AtLeastOf(_, _, _, body) | ir.OfAgent(_, body):
            return local(body)
        case ir.Without():
            return False
        case _:
            return True


@settings(max_examples=200)
@given(cases())
def test_a_formula_in_kernel_form_looks_as_far_as_it_did_before(case: Case) -> None:
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", case.formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    formula = kernel.requirements[0].formula
    found, meant = steps_ahead([formula])[formula], reference.ahead(case.formula)
    assert found <= meant
    if local(case.formula):
        assert found == meant


def test_what_no_step_asks_is_relevant_nowhere() -> None:
    hold, end = Any(()), All(())
    relevant = dict(relevance((Until(hold, end, 0, 0),), agents=2, last=3))
    assert not relevant[hold].any()
    assert relevant[end].tolist() == [[True, False, False, False]] * 2


def steps_asked(node: Node, of: Node) -> list[int]:
    """The steps at which one node is asked where the other, about a team of one, is asked at the first."""
    (steps,) = dict(relevance((of,), agents=1, last=LAST))[node]
    return [step for step, asked in enumerate(steps) if asked]


@pytest.mark.parametrize(("low", "high"), WINDOWS)
def test_a_window_asks_at_its_steps_that_the_mission_has(low: int, high: int | None) -> None:
    body = Is(frozenset((0,)))
    window = Eventually(body, low, high)
    for first in range(LAST + 1):
        end = LAST if high is None else first + high
        meant = range(max(first + low, 0), min(end, LAST) + 1)
        assert steps_asked(body, Eventually(window, first, first)) == list(meant)


def test_nested_windows_ask_at_every_step_of_each() -> None:
    body = Is(frozenset((0,)))
    either = Any((Eventually(body, 0, 0), Eventually(body, 3, 4)))
    assert steps_asked(body, either) == [0, 3, 4]
    assert steps_asked(body, Eventually(either, 0, 1)) == [0, 1, 3, 4]


def test_what_is_to_hold_until_the_end_is_asked_up_to_the_step_before_it() -> None:
    hold, end = Is(frozenset((0,))), Is(frozenset((1,)))
    assert steps_asked(hold, Until(hold, end, 1, None)) == [0, 1, 2, 3]
    assert steps_asked(end, Until(hold, end, 1, None)) == [1, 2, 3, 4]
    assert steps_asked(hold, Until(hold, end, 1, 2)) == [0, 1]


def test_who_has_to_remember_is_whoever_is_asked_what_reads_the_past() -> None:
    past = Atom(ir.Flagged(flags_of(3)[0]))
    now = Atom(ir.Inside(FIELD, False))
    assert remembering((At(2, past), At(1, now))) == {2}
    assert remembering((At(1, Neighbour(graphs_of(3)[2], past)), past)) == {0, 1, 2}
    assert remembering((At(1, now),)) == set()


def test_agents_that_join_help_what_looks_for_one_and_hinder_what_is_to_hold_at_all() -> None:
    radio, body = graphs_of(3)[0], Is(frozenset((0,)))
    some, every = Neighbour(radio, body), EveryNeighbour(radio, body)
    known = helped_by_more((Any((some, Not(body))), All((every, some))))
    helped = {type(node).__name__: known[node] for node in known if not isinstance(node, Is)}
    assert helped == {"Neighbour": True, "Not": True, "Any": True, "EveryNeighbour": False, "All": False}
