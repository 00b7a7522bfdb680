"""What a strengthened requirement promises: it is no weaker at the steps, and what is convex holds between them."""

from __future__ import annotations

from typing import TypeAlias

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Trace
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir import Mission
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Reach,
    Release,
    Until,
)
from missionc.ir.lower.expand import expand
from missionc.ir.lower.hold_throughout import hold_throughout
from missionc.verification.between.between_steps import between_steps
from missionc.verification.certificate import Verdict
from missionc.verification.monitoring.monitor import truths
from tests.support.random_runs import BASE, FIELD, SPAN, Case, cases, graphs_of, mission_of, positions, trace_of

Drawn: TypeAlias = st.SearchStrategy[Node]
STEPS = 6


def satisfied(mission: Mission, kernel: Kernel, trace: Trace) -> bool:
    formula = kernel.requirements[0].formula
    return bool(truths([formula], mission, trace)[formula][0, 0])


@settings(max_examples=150, deadline=None)
@given(cases())
def test_who_keeps_what_is_strengthened_keeps_the_requirement(case: Case) -> None:
    size, steps = case.trace.position.shape[0], case.trace.position.shape[1] - 1
    mission = mission_of(size, steps, ir.Requirement("asked", ir.OfAgent(0, case.formula, SPAN), SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    if satisfied(mission, hold_throughout(mission, kernel, {"asked"}), case.trace):
        assert satisfied(mission, kernel, case.trace)


def windows(body: Drawn, budget: int) -> Drawn:
    """Operators of time over a body that may be asked so many steps ahead."""
    bounds = st.tuples(st.integers(0, budget), st.integers(0, budget)).map(sorted)
    one = st.builds(lambda kind, each, window: kind(each, *window), st.sampled_from([Always, Eventually]), body, bounds)
    longer = st.tuples(st.integers(0, budget), st.integers(1, budget)).map(sorted)
    two = st.builds(
        lambda kind, hold, end, window: kind(hold, end, *window), st.sampled_from([Until, Release]), body, body, longer
    )
    return st.one_of(one, two)


def combined(part: Drawn) -> Drawn:
    """Formulas without negation, over two agents that may be linked."""
    graph = graphs_of(3)[0]
    several = st.lists(part, min_size=2, max_size=3).map(tuple)
    return st.one_of(
        st.builds(lambda parts: All(parts), several),
        st.builds(lambda parts: Any(parts), several),
        st.builds(lambda parts: AtLeast(2, parts), several),
        st.builds(At, st.integers(0, 2), part),
        st.builds(lambda body: Neighbour(graph, body), part),
        st.builds(lambda through, end, hops: Reach(graph, through, end, hops), part, part, st.integers(0, 2)),
    )


INSIDE: Drawn = st.sampled_from([Atom(ir.Inside(region, False)) for region in (BASE, FIELD)])
STATES = st.one_of(INSIDE, combined(INSIDE), combined(combined(INSIDE)))
FORMULAS = st.one_of(windows(STATES, STEPS), windows(st.one_of(STATES, windows(STATES, 2)), STEPS - 2))


def asked(formula: Node) -> tuple[Mission, Kernel]:
    return mission_of(3, STEPS), Kernel((Goal("asked", At(0, formula), SPAN),), ())


@settings(max_examples=150, deadline=None)
@given(FORMULAS, positions(3, STEPS))
def test_what_is_convex_and_strengthened_does_not_fail_between_the_steps(
    formula: Node, places: list[list[tuple[float, ...]]]
) -> None:
    mission, kernel = asked(formula)
    trace = trace_of(places)
    if satisfied(mission, hold_throughout(mission, kernel, {"asked"}), trace):
        (found,) = between_steps(mission, kernel, trace, motion(mission, trace))
        assert found.verdict is not Verdict.FAILS, found.detail


def handover(last: float) -> Trace:
    """The first leaves the base between two steps, the second comes in between the same or the step before."""
    away, here = (2.0, 2.0), (0.5, 0.5)
    first = [here, here, here, away, away, away, away]
    second = [away, away, here if last == 2 else away, here, here, here, here]
    return trace_of([first, second, [away] * 7])


@pytest.mark.parametrize(("comes", "holds"), [(2, True), (3, False)])
def test_one_who_takes_over_has_to_be_there_before_the_other_leaves(comes: float, holds: bool) -> None:
    there = Atom(ir.Inside(BASE, False))
    mission, kernel = asked(Always(Any((At(0, there), At(1, there))), 0, None))
    trace = handover(comes)
    assert satisfied(mission, kernel, trace)
    assert satisfied(mission, hold_throughout(mission, kernel, {"asked"}), trace) is holds
    (found,) = between_steps(mission, kernel, trace, motion(mission, trace))
    assert found.holds is holds


def test_a_team_that_stays_connected_keeps_a_link_until_another_is_there() -> None:
    """The third goes past the two others, out of the first's reach before it is in the second's, or nearer to them."""
    radio = graphs_of(3)[0]
    joined = At(1, Reach(radio, All(()), Is(frozenset((0,))), 2)), At(2, Reach(radio, All(()), Is(frozenset((0,))), 2))
    mission, kernel = asked(Always(All(joined), 0, None))
    line, start, end = [[(1.0, 0.5)] * 7, [(1.9, 0.5)] * 7], (1.0, 1.45), (1.9, 1.45)
    leap = trace_of([*line, [*[start] * 3, *[end] * 4]])
    walk = trace_of([*line, [*[start] * 3, (1.45, 1.2), *[end] * 3]])
    strengthened = hold_throughout(mission, kernel, {"asked"})
    for trace, lasts in ((leap, False), (walk, True)):
        assert satisfied(mission, kernel, trace)
        assert satisfied(mission, strengthened, trace) is lasts
        (found,) = between_steps(mission, kernel, trace, motion(mission, trace))
        assert found.holds is lasts


def test_requirements_of_other_names_stay_the_same_objects() -> None:
    mission, kernel = asked(Always(Atom(ir.Inside(BASE, False)), 0, STEPS))
    assert hold_throughout(mission, kernel, {"another"}).requirements[0] is kernel.requirements[0]
