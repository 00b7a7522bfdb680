"""The monitor's own arithmetic against plain definitions, and its verdicts against each other."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from missionc import ir
from missionc.base.units import Steps
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.evaluate import sliding, until
from missionc.verification.monitoring.monitor import monitor, robustness, truth
from tests import reference
from tests.support.random_runs import SPAN, Case, cases, leaves, mission_of, run_of, trace_of

steps = st.integers(1, 40)
bounds = st.tuples(st.integers(0, 45), st.one_of(st.none(), st.integers(0, 45))).map(
    lambda pair: (pair[0], None if pair[1] is None else pair[0] + pair[1])
)
seeds = st.integers(0, 2**32 - 1)


def window_of(low: int, high: int | None, step: int, last: int) -> range:
    """The steps of a window; none where it runs past the last step or starts after it."""
    end = last if high is None else step + high
    return range(step + low, end + 1) if step + low <= end <= last else range(0)


@given(steps, bounds, seeds)
def test_sliding_windows_are_the_minimum_and_maximum_of_each(
    count: int, window: tuple[int, int | None], seed: int
) -> None:
    values = np.random.default_rng(seed).integers(0, 9, (2, count)).astype(float)
    lowest = sliding(np.minimum, values, *window, -np.inf)
    highest = sliding(np.maximum, values > 4, *window, False)
    for agent in range(2):
        for step in range(count):
            inside = [values[agent, later] for later in window_of(*window, step, count - 1)]
            assert lowest[agent, step] == min(inside, default=-np.inf)
            assert highest[agent, step] == (max(inside, default=0.0) > 4)


@given(steps, bounds, seeds)
def test_until_is_its_definition(count: int, window: tuple[int, int | None], seed: int) -> None:
    hold, end = np.random.default_rng(seed).integers(0, 99, (2, 2, count)).astype(float)
    freed = until(hold, end, *window, -np.inf)
    for agent in range(2):
        for step in range(count):
            expected = max(
                (min([end[agent, later], *hold[agent, step:later]]) for later in window_of(*window, step, count - 1)),
                default=-np.inf,
            )
            assert freed[agent, step] == expected


@given(cases())
def test_a_judgement_agrees_with_the_reference_and_its_sign_with_its_verdict(case: Case) -> None:
    size = len(case.trace.position)
    every = ir.AtLeastOf("every", size, ir.AgentSet("drone", tuple(range(size)), SPAN), case.formula, SPAN)
    mission = mission_of(size, case.run.last, ir.Requirement("asked", every, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    (judgement,) = monitor(mission, kernel, case.trace).requirements
    assert judgement.satisfied == reference.truth(every, case.run, 0, 0)
    assert judgement.robustness >= 0 if judgement.satisfied else judgement.robustness <= 0
    assert (judgement.step is None) == judgement.satisfied


@given(st.data())
def test_a_broken_always_is_broken_first_where_the_monitor_says(data: st.DataObject) -> None:
    size, last = 3, 4
    places = np.random.default_rng(data.draw(seeds)).integers(0, 5, (size, last + 1, 2)) / 2
    trace = trace_of(places.tolist())
    mission = mission_of(size, last)
    body = data.draw(leaves(size))
    always = ir.Apply(by_name["always"], (body,), ir.Window(Steps(0), Steps(last), SPAN), SPAN)
    every = ir.AtLeastOf("every", size, ir.AgentSet("drone", (0, 1, 2), SPAN), always, SPAN)
    kernel, _ = expand(mission_of(size, last, ir.Requirement("asked", every, SPAN)))
    assert kernel is not None
    (judgement,) = monitor(mission, kernel, trace).requirements
    run = run_of(mission, trace)
    broken = [
        [f"drone[{agent}]" for agent in range(size) if not reference.truth(body, run, agent, step)]
        for step in range(last + 1)
    ]
    first = next((step for step in range(last + 1) if broken[step]), None)
    assert judgement.step == first
    if first is not None and isinstance(body, ir.Belongs):
        assert list(judgement.agents) == broken[first]


@given(cases())
def test_values_do_not_depend_on_what_else_is_asked(case: Case) -> None:
    size = len(case.trace.position)
    doubled = ir.Apply(by_name["and"], (case.formula, case.formula), None, SPAN)
    goals = tuple(ir.Requirement(str(index), each, SPAN) for index, each in enumerate((case.formula, doubled)))
    kernel, _ = expand(mission_of(size, case.run.last, *goals))
    assert kernel is not None
    alone, twice = (goal.formula for goal in kernel.requirements)
    mission = case.run.mission
    assert np.array_equal(truth(alone, mission, case.trace), truth(twice, mission, case.trace))
    assert np.array_equal(robustness(alone, mission, case.trace), robustness(twice, mission, case.trace))
