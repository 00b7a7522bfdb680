"""From the mission as meant to its kernel, and the kernel as text."""

from __future__ import annotations

from dataclasses import replace

import pytest

from missionc import ir
from missionc.base.diagnostics.code import TOO_LARGE_TO_EXPAND
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import Metres, Metric, Steps
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Is, Kernel, Node, Not, Reach
from missionc.ir.kernel.show import show
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from tests.support.random_runs import BASE, FIELD, SPAN, graphs_of, mission_of

ELSEWHERE = Span(Source("other.mission", "some other words"), 0, 4)


def holds(predicate: ir.Predicate, span: Span = SPAN) -> ir.Holds:
    return ir.Holds(predicate, span)


def apply(name: str, *operands: ir.Formula, bounds: ir.Window | ir.Length | None = None) -> ir.Apply:
    return ir.Apply(by_name[name], operands, bounds, SPAN)


def asked(*formulas: ir.Formula, size: int = 3) -> ir.Mission:
    goals = (ir.Requirement(f"asked{number}", formula, SPAN) for number, formula in enumerate(formulas))
    return mission_of(size, 6, *goals)


def kernel_of(mission: ir.Mission) -> Kernel:
    kernel, findings = expand(mission)
    assert findings == []
    assert kernel is not None
    return kernel


def node_of(formula: ir.Formula, size: int = 3) -> Node:
    return kernel_of(asked(formula, size=size)).requirements[0].formula


IN_BASE, IN_FIELD = holds(ir.Inside(BASE, body=False)), holds(ir.Inside(FIELD, body=False))


def test_a_formula_used_twice_is_one_node() -> None:
    first, second = kernel_of(asked(apply("not", IN_BASE), apply("or", IN_BASE, IN_BASE))).requirements
    assert isinstance(first.formula, Not)
    assert isinstance(second.formula, Any)
    assert set(second.formula.parts) == {first.formula.body}


@pytest.mark.parametrize(
    ("kind", "number", "expected"), [("every", 3, All), ("some", 1, Any), ("at least", 2, AtLeast)]
)
def test_a_quantifier_is_its_body_at_each_agent(kind: str, number: int, expected: type[Node]) -> None:
    members = ir.AgentSet("drone", (2, 0, 1), SPAN)
    node = node_of(ir.AtLeastOf(kind, number, members, IN_BASE, SPAN))
    assert isinstance(node, expected)
    assert isinstance(node, All | Any | AtLeast)
    assert [part.agent for part in node.parts if isinstance(part, At)] == [2, 0, 1]
    assert len({part.body for part in node.parts if isinstance(part, At)}) == 1
    if isinstance(node, AtLeast):
        assert node.count == 2


def test_belonging_and_truth_need_no_predicate() -> None:
    belongs = node_of(ir.Belongs(ir.AgentSet("drone", (0, 2), SPAN), SPAN))
    assert isinstance(belongs, Is)
    assert belongs.agents == {0, 2}
    assert isinstance(true := node_of(ir.Truth(True, SPAN)), All)
    assert isinstance(false := node_of(ir.Truth(False, SPAN)), Any)
    assert true.parts == false.parts == ()


def test_connected_is_a_route_from_each_agent_to_the_first_over_those_agents() -> None:
    radio = graphs_of(4)[0]
    asked = node_of(holds(ir.Connected(radio, (3, 1, 2))), size=4)
    assert isinstance(asked, All)
    (node,) = asked.parts
    assert isinstance(node, All)
    assert [part.agent for part in node.parts if isinstance(part, At)] == [1, 2]
    (reach,) = {part.body for part in node.parts if isinstance(part, At)}
    assert isinstance(reach, Reach)
    assert (reach.graph.name, reach.graph.agents) == (radio.name, (3, 1, 2))
    assert isinstance(reach.end, Is)
    assert (reach.end.agents, reach.hops) == (frozenset((3,)), 2)


def test_connected_over_the_whole_graph_keeps_the_graph() -> None:
    mission = mission_of(3, 0)
    radio = mission.graphs[0]
    node = node_of(holds(ir.Connected(radio, radio.agents)))
    assert all(below.graph is radio for below in postorder([node]) if isinstance(below, Reach))


def test_connected_is_the_same_nodes_wherever_it_is_asked_below_its_own_words() -> None:
    mission = mission_of(3, 0)
    radio = mission.graphs[0]
    twice = [holds(ir.Connected(radio, radio.agents), span) for span in (SPAN, ELSEWHERE)]
    one, other = (goal.formula for goal in kernel_of(asked(*twice)).requirements)
    assert (one.span, other.span) == (SPAN, ELSEWHERE)
    assert children(one) == children(other)


def test_a_node_keeps_the_words_it_came_from() -> None:
    node = node_of(holds(ir.Inside(BASE, body=False), ELSEWHERE))
    assert isinstance(node, Atom)
    assert node.span is ELSEWHERE


def test_preferences_keep_their_weight_and_requirements_have_none() -> None:
    wished = ir.Preference("calm", IN_BASE, 2.0, SPAN)
    kernel = kernel_of(replace(asked(IN_FIELD), preferences=(wished,)))
    assert [goal.weight for goal in kernel.requirements] == [None]
    assert [(goal.name, goal.weight) for goal in kernel.preferences] == [("calm", 2.0)]


def test_a_lower_bound_that_grows_too_large_is_reported_with_its_limit() -> None:
    graph = ir.Proximity("radio", Metres(1.0), tuple(range(40)), SPAN)
    reach = apply("reach", IN_BASE, IN_FIELD, bounds=ir.Length(graph, Metric.HOPS, 9.0, 12.0, SPAN))
    kernel, findings = expand(asked(reach, apply("not", reach), size=40), Limits(formula_nodes=5000))
    assert kernel is None
    assert [finding.code for finding in findings] == [TOO_LARGE_TO_EXPAND]
    assert "the limit is 5000" in findings[0].message
    assert "`reach`" in findings[0].message


def test_a_chain_of_ten_thousand_formulas_is_expanded_and_shown() -> None:
    formula: ir.Formula = IN_BASE
    for _ in range(10_000):
        formula = apply("next", formula)
    mission = asked(formula)
    assert len(show(kernel_of(mission), mission).splitlines()) == 10_001


def test_the_kernel_is_shown_one_node_a_line_with_shared_nodes_named() -> None:
    everyone = ir.AgentSet("drone", (0, 1), SPAN)
    radio = graphs_of(2)[0]
    route = apply("reach", apply("not", IN_FIELD), IN_BASE, bounds=ir.Length(radio, Metric.HOPS, 0.0, 2.0, SPAN))
    slow = holds(ir.Compare(((-1.0, ir.Speed()), (2.0, ir.DistanceTo(BASE))), 1.5, strict=True))
    relay = apply("always", route, bounds=ir.Window(Steps(0), None, SPAN))
    calm = apply("until", slow, ir.Belongs(everyone, SPAN), bounds=ir.Window(Steps(1), Steps(3), SPAN))
    goals = (
        ir.Requirement("relay", ir.AtLeastOf("every", 2, everyone, relay, SPAN), SPAN),
        ir.Requirement("together", holds(ir.Connected(radio, radio.agents)), SPAN),
    )
    wish = ir.Preference("calm", ir.OfAgent(1, calm, SPAN), 0.5, SPAN)
    mission = replace(mission_of(2, 6, *goals), preferences=(wish,))
    assert show(kernel_of(mission), mission) == (
        "%1 = not field reach 1 hops on radio base\n"
        "%2 = always [0..end] %1\n"
        "%3 = at drone[0] %2\n"
        "%4 = at drone[1] %2\n"
        "%5 = all(%3, %4)\n"
        "%6 = true reach 1 hops on radio is(drone[0])\n"
        "%7 = at drone[1] %6\n"
        "%8 = all(%7)\n"
        "%9 = all(%8)\n"
        "%10 = (-1*speed + 2*distance(base) + 1.5 > 0) until [1..3] is(drone[0], drone[1])\n"
        "%11 = at drone[1] %10\n"
        "require relay = %5\n"
        "require together = %9\n"
        "prefer[0.5] calm = %11\n"
    )
