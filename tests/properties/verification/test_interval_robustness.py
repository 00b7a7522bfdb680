"""Intervals at the first and the last step, against random runs that begin and end as the mission says."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.frontend.checks.broken_ends import broken_ends
from missionc.frontend.checks.check_ends import check_ends
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.possible_ends import possible
from missionc.ir.kernel.nodes import Always, Eventually, Is, Node, Release, Until
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.end_columns import FIRST, LAST
from missionc.verification.monitoring.interval_robustness import Intervals, RobustnessInterval
from missionc.verification.monitoring.monitor import robustness
from tests import reference
from tests.support.random_runs import BASE, SPAN, Case, cases, mission_of

EXAMPLES = int(os.environ.get("MISSIONC_FUZZ", "150"))


@cache
@st.composite
def ended(draw: st.DrawFn, first: Operator | None = None) -> tuple[ir.Mission, Case]:
    """A case and a mission that lets its agents start and finish as they do: at a point, in a region, or anywhere."""
    case = draw(cases(first).filter(lambda one: reference.ahead(one.formula) <= one.run.last))
    position = case.trace.position.copy()
    size, steps = len(position), case.run.last
    mission = mission_of(size, steps, ir.Requirement("asked", ir.OfAgent(0, case.formula, SPAN), SPAN))
    agents = []
    for agent in mission.agents:
        start: ir.InitialSet = ir.InitialSet(SPAN, tuple(position[agent.index, 0].tolist()))
        finish: ir.InitialSet | None = ir.InitialSet(SPAN, tuple(position[agent.index, -1].tolist()))
        if draw(st.booleans()):
            position[agent.index, 0] = draw(st.tuples(st.sampled_from([0.0, 0.5, 1.0]), st.sampled_from([0.0, 1.5])))
            start = ir.InitialSet(SPAN, region=BASE)
        if draw(st.booleans()):
            finish = None
        agents.append(replace(agent, start=start, finish=finish))
    trace = replace(case.trace, position=position)
    return replace(mission, agents=tuple(agents)), replace(case, trace=trace)


def decided(root: Node, last: int) -> set[tuple[Node, int]]:
    """The leaves, at both ends, and the root at the first: what a run can be held against."""
    return {(node, column) for node in postorder([root]) for column in (0, last) if not children(node)} | {(root, 0)}


def hold_against(mission: ir.Mission, case: Case) -> None:
    """What the run is worth at its ends is in the intervals, and who denies a requirement is right."""
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    (goal,) = kernel.requirements
    ground = FreeSpace.of(mission)
    known = Intervals(mission, ground.atlas).of([goal.formula])
    last = case.run.last
    for node, step in decided(goal.formula, last):
        values = robustness(node, mission, case.trace)[:, step]
        interval = known[node]
        column = FIRST if step == 0 else LAST
        if node is goal.formula:
            values = values[:1]
        assert (interval.least[:, column] - 1e-9 <= values).all()
        assert (values <= interval.most[:, column] + 1e-9).all()
    if check_ends(mission, kernel, ground):
        assert not bool(reference.truth(case.formula, replace_run(case), 0, 0))


@settings(max_examples=EXAMPLES)
@given(ended())
def test_what_a_run_is_worth_at_its_ends_is_in_the_interval(drawn: tuple[ir.Mission, Case]) -> None:
    hold_against(*drawn)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=EXAMPLES // 10)
@given(data=st.data())
def test_so_it_is_below_every_operator(operator: Operator, data: st.DataObject) -> None:
    hold_against(*data.draw(ended(operator)))


@settings(max_examples=EXAMPLES)
@given(ended())
def test_what_places_show_to_be_possible_is_possible_by_the_intervals(drawn: tuple[ir.Mission, Case]) -> None:
    mission, _ = drawn
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    (goal,) = kernel.requirements
    ground = FreeSpace.of(mission)
    if goal.formula in possible(mission, [goal.formula], ground):
        assert Intervals(mission, ground.atlas).of([goal.formula])[goal.formula].most[0, FIRST] >= 0
        assert broken_ends(mission, kernel, ground) == []


def replace_run(case: Case) -> reference.Run:
    """The run as its trace has it."""
    positions = [[tuple(point) for point in agent] for agent in case.trace.position.tolist()]
    return replace(case.run, position=positions)


def test_a_point_leaves_no_room() -> None:
    mission = mission_of(
        2, 3, ir.Requirement("asked", ir.OfAgent(0, ir.Holds(ir.Inside(BASE, False), SPAN), SPAN), SPAN)
    )
    kernel, _ = expand(mission)
    assert kernel is not None
    (goal,) = kernel.requirements
    interval = Intervals(mission, FreeSpace.of(mission).atlas).of([goal.formula])[goal.formula]
    np.testing.assert_allclose(interval.least[0, FIRST], 0.0, atol=1e-300)
    np.testing.assert_allclose(interval.most[0, FIRST], 0.0, atol=1e-300)
    assert (interval.least[0, LAST], interval.most[0, LAST]) == (-np.inf, np.inf)


INF = float("inf")
ONE, OTHER = Is(frozenset((0,))), Is(frozenset((1,)))
BODY = RobustnessInterval(np.array([[1.0, -2.0]]), np.array([[3.0, 5.0]]))
"""Worth 1 to 3 at the first step, and -2 to 5 at the last."""
END = RobustnessInterval(np.array([[-4.0, -1.0]]), np.array([[2.0, 6.0]]))


def between(known: RobustnessInterval) -> list[tuple[float, float]]:
    """The interval at the first and at the last step."""
    return list(zip(known.least[0].tolist(), known.most[0].tolist(), strict=True))


@pytest.mark.parametrize(
    ("low", "high", "some", "every"),
    [
        (0, 0, [(1, 3), (-2, 5)], [(1, 3), (-2, 5)]),
        (0, 1, [(1, INF), (-INF, INF)], [(-INF, 3), (-INF, INF)]),
        (0, 3, [(1, INF), (-INF, INF)], [(-INF, 3), (-INF, INF)]),
        (0, None, [(1, INF), (-2, 5)], [(-INF, 3), (-2, 5)]),
        (3, 3, [(-2, 5), (-INF, INF)], [(-2, 5), (-INF, INF)]),
        (3, None, [(-2, 5), (-INF, INF)], [(-2, 5), (-INF, INF)]),
        (2, None, [(-2, INF), (-INF, INF)], [(-INF, 5), (-INF, INF)]),
        (1, 2, [(-INF, INF), (-INF, INF)], [(-INF, INF), (-INF, INF)]),
        (-3, 0, [(1, 3), (1, INF)], [(1, 3), (-INF, 3)]),
        (-3, -3, [(-INF, -INF), (1, 3)], [(INF, INF), (1, 3)]),
        (-1, 0, [(1, 3), (-2, INF)], [(1, 3), (-INF, 5)]),
    ],
)
def test_a_window_is_worth_what_the_known_steps_in_it_decide(
    low: int, high: int | None, some: list[tuple[float, float]], every: list[tuple[float, float]]
) -> None:
    mission = mission_of(2, 3)
    intervals = Intervals(mission, FreeSpace.of(mission).atlas)
    assert between(intervals.window(Eventually(ONE, low, high), BODY)) == some
    assert between(intervals.window(Always(ONE, low, high), BODY)) == every


@pytest.mark.parametrize(
    ("low", "high", "until", "release"),
    [
        (0, 0, [(-4, 2), (-1, 6)], [(-4, 2), (-1, 6)]),
        (0, 3, [(-4, 3), (-INF, INF)], [(-4, 2), (-INF, INF)]),
        (1, 3, [(-INF, 3), (-INF, INF)], [(1, INF), (-INF, INF)]),
        (0, None, [(-4, 3), (-1, 6)], [(-4, 2), (-1, 6)]),
        (3, None, [(-INF, 3), (-INF, INF)], [(1, INF), (-INF, INF)]),
        (-3, 0, [(-4, 2), (-1, INF)], [(-4, 2), (-INF, 6)]),
        (-3, -1, [(-INF, -INF), (-INF, INF)], [(INF, INF), (-INF, INF)]),
    ],
)
def test_an_until_is_worth_what_now_and_the_known_steps_decide(
    low: int, high: int | None, until: list[tuple[float, float]], release: list[tuple[float, float]]
) -> None:
    mission = mission_of(2, 3)
    intervals = Intervals(mission, FreeSpace.of(mission).atlas)
    assert between(intervals.until(Until(ONE, OTHER, low, high), BODY, END)) == until
    assert between(intervals.until(Release(ONE, OTHER, low, high), BODY, END)) == release
