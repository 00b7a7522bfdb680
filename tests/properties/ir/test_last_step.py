"""The last step: no rewriting of a kernel asks about a later one, and every verdict is decided by then."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.hybrid.backend import discrete
from missionc.base.trace import Trace
from missionc.base.units import Metres, Steps
from missionc.compiler.alternatives.restriction import Restriction, restrictions
from missionc.ir import Mission
from missionc.ir.kernel.nodes import All, Any, At, Atom, Eventually, Goal, Kernel, Until
from missionc.ir.kernel.walk import asked_between, postorder
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS
from missionc.ir.lower.expand import expand
from missionc.ir.lower.hold_throughout import hold_throughout
from missionc.ir.lower.tighten import ahead_of_time, tightened_alone
from missionc.ir.predicates import Inside
from missionc.planning.progression.formula_progression import NotProgressableError
from missionc.planning.progression.stretches import Remaining, Stretch, after
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.monitoring.signature import Signatures
from missionc.verification.monitoring.violation import first_violation
from tests.support.random_runs import BASE, FIELD, SPAN, Case, as_planned, cases, mission_of, positions, trace_of


def latest(kernel: Kernel, last: int) -> int:
    """The last step that anything is asked at."""
    formulas = [goal.formula for goal in (*kernel.requirements, *kernel.preferences)]
    return max((end for _, end in asked_between(formulas, last).values()), default=0)


def asked(case: Case) -> tuple[Mission, Kernel]:
    """A mission that asks the formula of every agent, and of some."""
    size = len(case.trace.position)
    everybody = ir.AgentSet("drone", tuple(range(size)), SPAN)
    wanted = tuple(
        ir.Requirement(kind, ir.AtLeastOf(kind, number, everybody, case.formula, SPAN), SPAN)
        for kind, number in (("every", size), ("some", 1))
    )
    late = ir.Tolerance(tuple(range(size)), Steps(1), SPAN)
    mission = replace(case.run.mission, requirements=wanted, tolerances=(late,))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return mission, kernel


def rewritten(mission: Mission, kernel: Kernel, trace: Trace, formula: ir.Formula) -> Iterator[tuple[Kernel, int]]:
    """Kernels that something is made of in place of this one, each with its last step."""
    names = {goal.name for goal in kernel.requirements}
    planned = as_planned(mission, kernel, formula)
    for each in (planned, hold_throughout(mission, kernel, names), tightened_alone(kernel, names, Metres(0.1))):
        yield each, mission.steps
    yield as_planned(mission, hold_throughout(mission, kernel, names), formula), mission.steps
    yield ahead_of_time(mission, kernel), mission.steps
    for ticks in (mission.steps, 2 * mission.steps, max(1, mission.steps // 2)):
        yield discrete(planned, mission.steps, ticks).kernel, ticks
    signature = Signatures(mission, kernel).of(trace)
    for restriction in restrictions(Restriction(), signature, mission, trace.position, sides=False):
        yield restriction.applied(mission, kernel)[1], mission.steps
    for elapsed in range(1, mission.steps):
        first = Trace(trace.step, *(each[:, : elapsed + 1] for each in (trace.position, trace.velocity, trace.heading)))
        try:
            left = after(Remaining(mission, kernel), Stretch(first), mission)
        except NotProgressableError:
            continue
        yield left.kernel, left.mission.steps


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=5)
@given(data=st.data())
def test_no_rewriting_asks_anything_of_the_steps_after_the_last(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(cases(operator))
    mission, kernel = asked(case)
    assume(latest(kernel, mission.steps) <= mission.steps)
    for other, last in rewritten(mission, kernel, case.trace, case.formula):
        assert latest(other, last) <= last


@settings(max_examples=25)
@given(cases())
def test_every_verdict_is_decided_at_a_step_of_the_trace(case: Case) -> None:
    """Also that of a formula that looks past the last step."""
    _, kernel = asked(case)
    for node in postorder(goal.formula for goal in kernel.requirements):
        assert 0 <= first_violation(node, case.run.mission, case.trace).step <= case.run.last


TOUR_STEPS = 6


@settings(max_examples=15)
@given(st.lists(st.integers(0, TOUR_STEPS), min_size=2, max_size=2), positions(2, TOUR_STEPS))
def test_an_order_is_reversed_within_the_steps_at_which_both_are_asked_for(
    firsts: list[int], places: list[list[tuple[float, ...]]]
) -> None:
    base, field = (Atom(Inside(region, False)) for region in (BASE, FIELD))
    goals = tuple(
        Goal(f"tour {first}", At(0, Eventually(All((one, Eventually(other, 0, TOUR_STEPS - first))), 0, first)), SPAN)
        for first, one, other in zip(firsts, (base, field), (field, base), strict=True)
    )
    mission, trace, kernel = mission_of(2, TOUR_STEPS), trace_of(places), Kernel(goals, ())
    signature = Signatures(mission, kernel).of(trace)
    for restriction in restrictions(Restriction(), signature, mission, trace.position, sides=False):
        ((first, second),) = restriction.first
        assert first.before(second) is False
        assert latest(restriction.applied(mission, kernel)[1], TOUR_STEPS) <= TOUR_STEPS


@pytest.mark.parametrize(("xs", "holds"), [((9.0, 0.5, 1.0, 2.0), True), ((9.0, 0.5, 0.5, 2.0), False)])
def test_what_lasts_until_the_last_step_is_asked_of_no_later_one(xs: tuple[float, ...], holds: bool) -> None:
    """``(next inside) until[3, 3] there`` of three steps: at the second, its left side looks at the last."""
    inside, there = (Atom(Inside(region, False)) for region in (BASE, FIELD))
    mission, trace = mission_of(1, 3), trace_of([[(x, 0.5) for x in xs]])
    next_inside = Eventually(Any((inside, there)), 1, 1)
    kernel = Kernel((Goal("g", At(0, Until(next_inside, there, 3, 3)), SPAN),), ())
    strengthened = hold_throughout(mission, kernel, {"g"})
    assert latest(kernel, 3) == latest(strengthened, 3) == 3
    assert monitor(mission, strengthened, trace).requirements[0].satisfied is holds
