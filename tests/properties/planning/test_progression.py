"""What is left of a goal after some steps is worth in the rest what the goal is worth in the whole."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Trace
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS
from missionc.ir.lower.expand import expand
from missionc.planning.progression.formula_progression import NotProgressableError
from missionc.planning.progression.stretches import Remaining, Stretch, after
from missionc.verification.monitoring.monitor import truth
from tests import reference
from tests.support.random_runs import (
    SPAN,
    Case,
    cases,
    flags_of,
    mission_of,
    own_states,
    positions,
    remembering,
    resources_of,
    run_of,
    trace_of,
)


def cut(trace: Trace, first: int, last: int) -> Trace:
    """The states from one step to another, both included."""
    part = slice(first, last + 1)
    return Trace(trace.step, trace.position[:, part], trace.velocity[:, part], trace.heading[:, part])


def asked(case: Case) -> tuple[ir.Mission, Kernel]:
    """The mission with the requirement that every agent satisfies the formula, and some agent does."""
    size = len(case.trace.position)
    everybody = ir.AgentSet("drone", tuple(range(size)), SPAN)
    wanted = tuple(
        ir.Requirement(kind, ir.AtLeastOf(kind, number, everybody, case.formula, SPAN), SPAN)
        for kind, number in (("every", size), ("some", 1))
    )
    mission = replace(case.run.mission, requirements=wanted)
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return mission, kernel


def in_stretches(mission: ir.Mission, kernel: Kernel, trace: Trace, ends: list[int]) -> Remaining:
    """The mission after stretches that end at these steps."""
    left, begin = Remaining(mission, kernel), 0
    for end in ends:
        left, begin = after(left, Stretch(cut(trace, begin, end)), mission), end
    return left


def same(case: Case, ends: list[int]) -> None:
    mission, kernel = asked(case)
    try:
        left = in_stretches(mission, kernel, case.trace, ends)
    except NotProgressableError:
        assume(False)
    assert left.nobodys == ()
    rest = cut(case.trace, ends[-1], mission.steps)
    for whole, goal in zip(kernel.requirements, left.kernel.requirements, strict=True):
        expected = truth(whole.formula, mission, case.trace)[0, 0]
        assert truth(goal.formula, left.mission, rest)[0, 0] == expected
        assert not (expected and goal.name in left.violated)


def ends_of(last: int) -> st.SearchStrategy[list[int]]:
    return st.lists(st.integers(0, last - 1), min_size=1, max_size=2).map(sorted)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=60)
@given(data=st.data())
def test_what_is_left_is_worth_what_the_whole_is(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(cases(operator))
    assume(reference.ahead(case.formula) <= case.run.last)
    same(case, data.draw(ends_of(case.run.last)))


@settings(max_examples=100)
@given(data=st.data())
def test_resources_and_flags_go_on_as_they_were(data: st.DataObject) -> None:
    size, steps = data.draw(st.integers(1, 3)), data.draw(st.integers(1, 5))
    trace = trace_of(data.draw(positions(size, steps)))
    formula = data.draw(remembering(size, steps, own_states(size)))
    mission = replace(mission_of(size, steps), resources=resources_of(size), flags=flags_of(size))
    case = Case(run_of(mission, trace), trace, formula)
    assume(reference.ahead(formula) <= steps)
    same(case, data.draw(ends_of(steps)))
