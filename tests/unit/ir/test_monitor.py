"""What the monitor says of a trace: verdicts, and where a violation begins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Judgement, Trace
from missionc.base.units import Metres, Metric, Steps
from missionc.ir.language.margins import links
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import monitor, robustness, truth
from tests.support.random_runs import BASE, FIELD, SPAN, mission_of, trace_of

IN_BASE = ir.Holds(ir.Inside(BASE, body=False), SPAN)
IN_FIELD = ir.Holds(ir.Inside(FIELD, body=False), SPAN)
HOME, OUT = (0.5, 0.5), (3.0, 3.0)


def window(low: int, high: int | None) -> ir.Window:
    return ir.Window(Steps(low), None if high is None else Steps(high), SPAN)


def apply(name: str, *operands: ir.Formula, bounds: ir.Window | ir.Length | None = None) -> ir.Apply:
    return ir.Apply(by_name[name], operands, bounds, SPAN)


def of(kind: str, body: ir.Formula, *agents: int, number: int = 1) -> ir.AtLeastOf:
    return ir.AtLeastOf(kind, number, ir.AgentSet("these", agents, SPAN), body, SPAN)


def judged(formula: ir.Formula, trace: Trace) -> Judgement:
    size, states = trace.position.shape[:2]
    mission = mission_of(size, states - 1, ir.Requirement("asked", formula, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    (judgement,) = monitor(mission, kernel, trace).requirements
    return judgement


def where(formula: ir.Formula, trace: Trace) -> tuple[int | None, tuple[str, ...]]:
    judgement = judged(formula, trace)
    assert not judgement.satisfied
    return judgement.step, judgement.agents


# Drone 0 leaves home at step 2, drone 1 at step 3; drone 2 stays.
LEAVING = trace_of([[HOME, HOME, OUT, OUT], [HOME, HOME, HOME, OUT], [HOME, HOME, HOME, HOME]])


def test_a_requirement_that_holds_has_no_step_and_no_agents() -> None:
    judgement = judged(of("some", apply("always", IN_BASE, bounds=window(0, 3)), 0, 1, 2), LEAVING)
    assert judgement == Judgement("asked", True, 0.5)


def test_an_always_fails_at_the_first_step_and_the_drone_that_break_it() -> None:
    assert where(of("every", apply("always", IN_BASE, bounds=window(0, 3)), 0, 1, 2), LEAVING) == (2, ("drone[0]",))
    assert where(of("every", apply("always", IN_BASE, bounds=window(3, 3)), 0, 1, 2), LEAVING) == (
        3,
        ("drone[0]", "drone[1]"),
    )


def test_a_some_fails_when_the_last_of_them_does() -> None:
    formula = of("some", apply("always", IN_BASE, bounds=window(0, 3)), 0, 1)
    assert where(formula, LEAVING) == (3, ("drone[0]", "drone[1]"))


def test_an_at_least_fails_when_too_few_are_left() -> None:
    formula = of("at least", apply("always", IN_BASE, bounds=window(0, 3)), 0, 1, 2, number=3)
    assert where(formula, LEAVING) == (2, ("drone[0]",))
    assert judged(of("at least", apply("always", IN_BASE, bounds=window(0, 3)), 0, 1, 2, number=1), LEAVING).satisfied


def test_an_eventually_fails_at_the_end_of_its_window() -> None:
    assert where(of("some", apply("eventually", IN_FIELD, bounds=window(0, 2)), 2), LEAVING)[0] == 2
    assert where(of("some", apply("eventually", IN_FIELD, bounds=window(1, None)), 2), LEAVING)[0] == 3


def test_an_until_fails_where_it_is_given_up_too_early_or_never_met() -> None:
    assert where(of("every", apply("until", IN_BASE, IN_FIELD, bounds=window(0, 3)), 0), LEAVING) == (2, ("drone[0]",))
    assert where(of("every", apply("until", IN_BASE, IN_FIELD, bounds=window(0, 2)), 2), LEAVING) == (2, ("drone[2]",))


def test_a_denied_formula_fails_where_it_comes_true() -> None:
    away = apply("eventually", apply("not", IN_BASE), bounds=window(0, 3))
    assert where(of("every", apply("not", away), 1, 2), LEAVING) == (3, ("drone[1]",))


def test_a_broken_formation_names_the_agents_of_its_broken_edges() -> None:
    mission = mission_of(3, 0)
    chain = replace(mission.formations[0], tolerance=Metres(0.1))
    trace = trace_of([[(0.0, 0.0)], [(1.0, 0.0)], [(3.0, 0.0)]])
    assert where(ir.Holds(ir.InFormation(chain), SPAN), trace) == (0, ("drone[1]", "drone[2]"))


def test_a_distance_too_far_names_both_agents() -> None:
    close = ir.Holds(ir.Compare(((-1.0, ir.DistanceBetween(0, 2)),), 1.0, strict=False), SPAN)
    always = apply("always", close, bounds=window(0, 3))
    assert where(always, LEAVING) == (2, ("drone[0]", "drone[2]"))


def test_a_graph_in_two_names_who_is_cut_off_from_the_first() -> None:
    radio = mission_of(3, 0).graphs[0]
    connected = apply("always", ir.Holds(ir.Connected(radio, (0, 1, 2)), SPAN), bounds=window(0, 3))
    assert where(connected, LEAVING) == (2, ("drone[1]", "drone[2]"))


def test_what_is_false_anyway_fails_at_once_and_because_of_nobody() -> None:
    judgement = judged(ir.Truth(False, SPAN), LEAVING)
    assert (judgement.robustness, judgement.step, judgement.agents) == (-math.inf, 0, ())


def test_requirements_and_preferences_are_judged_apart() -> None:
    mission = mission_of(3, 3, ir.Requirement("asked", of("every", IN_BASE, 0), SPAN))
    mission = replace(mission, preferences=(ir.Preference("wished", of("some", IN_FIELD, 0), 1.0, SPAN),))
    kernel, _ = expand(mission)
    assert kernel is not None
    judged = monitor(mission, kernel, LEAVING)
    (asked,), (wished,) = judged.requirements, judged.preferences
    assert (asked.name, asked.satisfied) == ("asked", True)
    assert (wished.name, wished.satisfied) == ("wished", False)


def test_a_window_past_the_end_is_false_and_has_no_robustness() -> None:
    mission = mission_of(3, 3, ir.Requirement("asked", apply("always", IN_BASE, bounds=window(0, 2)), SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    node = kernel.requirements[0].formula
    assert truth(node, mission, LEAVING)[2].tolist() == [True, True, False, False]
    assert np.isneginf(robustness(node, mission, LEAVING)[2]).tolist() == [False, False, True, True]


def test_a_trace_that_does_not_fit_the_mission_is_refused() -> None:
    mission = mission_of(3, 5, ir.Requirement("asked", of("every", IN_BASE, 0), SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    with pytest.raises(ValueError, match="4 states, the mission 6"):
        monitor(mission, kernel, LEAVING)
    with pytest.raises(ValueError, match="3 agents, the mission 2"):
        truth(kernel.requirements[0].formula, mission_of(2, 3), LEAVING)


def test_a_formula_ten_thousand_deep_is_judged() -> None:
    formula: ir.Formula = IN_BASE
    for _ in range(10_001):
        formula = apply("not", formula)
    assert where(of("every", formula, 0), LEAVING) == (0, ("drone[0]",))


def test_a_long_trace_is_judged_in_pieces_to_the_same_values(monkeypatch: pytest.MonkeyPatch) -> None:
    generator = np.random.default_rng(1)
    trace = trace_of(generator.uniform(0.0, 3.0, (4, 31, 2)).tolist())
    mission = mission_of(4, 30)
    radio = ir.Proximity("radio", Metres(1.0), (3, 0, 1), SPAN)
    bounds = [
        ir.Length(radio, Metric.HOPS, 1.0, 2.0, SPAN),
        ir.Length(radio, Metric.METRES, 0.0, 2.0, SPAN),
        ir.Length(radio, Metric.METRES, 1.0, 3.0, SPAN),
    ]
    formulas = [apply(name, IN_FIELD, bounds=length) for name in ("somewhere", "escape") for length in bounds]
    kernel, _ = expand(replace(mission, requirements=tuple(ir.Requirement("r", each, SPAN) for each in formulas)))
    assert kernel is not None
    nodes = [goal.formula for goal in kernel.requirements]
    whole = [robustness(node, mission, trace).tolist() for node in nodes]
    monkeypatch.setattr(links, "ELEMENTS", 63)
    assert [robustness(node, mission, trace).tolist() for node in nodes] == whole
