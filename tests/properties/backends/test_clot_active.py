"""What has to hold of a motion, as the transport backend reads it off a formula, against the formula's robustness."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.units import Metric
from missionc.ir.kernel.nodes import Goal, Kernel, NeighbourNode, RouteNode
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import robustness
from tests import reference
from tests.support.random_runs import SPAN, Case, as_planned, cases, leaves, mission_of, run_of, trace_of

pytest.importorskip("torch")

from missionc.backends.clot.cost_graph.cost_graph import build, signed_predicate
from missionc.backends.clot.optimise.active_set import Active, Demand, Links, activate
from missionc.backends.clot.paper.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.motion_batch import States, team
from missionc.backends.clot.paper.robustness import Robustness
from missionc.base.trace import Array, Trace
from missionc.ir.kernel.nodes import AtLeast, Atom, EveryNeighbour, Node, Not, Release
from missionc.ir.language.margins.predicate_margins import all_links


def kernel_of(case: Case, formula: ir.Formula) -> Kernel:
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return as_planned(mission, kernel, formula)


def values_of(kernel: Kernel, mission: ir.Mission, trace: Trace) -> tuple[dict[Node, Array], Active, Node]:
    graph = build(kernel)
    values, links = judged(graph, mission, trace)
    root = graph.requirements[0].formula
    return values, activate(postorder(graph.formulas), (root,), values, links, trace.position, {}), root


def judged(graph: Kernel, mission: ir.Mission, trace: Trace) -> tuple[dict[Node, Array], dict[ir.Graph, Array]]:
    """The values of all terms, and the links of the graphs they read."""
    import torch

    states = States(torch.from_numpy(trace.position)[None], torch.from_numpy(trace.velocity)[None])
    judge = Robustness(team(mission, dtype=torch.float64), states)
    values = {node: value[0].numpy() for node, value in judge.values(postorder(graph.formulas)).items()}
    graphs = {node.graph for node in postorder(graph.formulas) if isinstance(node, NeighbourNode | RouteNode)}
    return values, {each: judge.links(each)[0].numpy() for each in graphs}


def is_negated(node: Node) -> bool:
    return isinstance(node, Not) and isinstance(node.body, Atom)


def least(active: Active, values: dict[Node, Array], trace: Trace) -> float:
    """The least of everything that has to hold."""
    shape = trace.position.shape[:2]
    found = [math.inf]
    worth = {
        signed_predicate(node): value for node, value in values.items() if isinstance(node, Atom) or is_negated(node)
    }
    for asked, mask in active.margins.items():
        found.extend(np.broadcast_to(worth[asked], shape)[mask].tolist())
    for node, stretches in active.lengths.items():
        for stretch in stretches:
            points = trace.position[list(stretch.agents), stretch.step]
            length = float(np.linalg.norm(np.diff(points, axis=0), axis=-1).sum())
            found.append((length - stretch.bound(node)) * (1.0 if stretch.longer else -1.0))
    for lists, sign in ((active.joined, 1.0), (active.parted, -1.0)):
        for graph, parts in lists.items():
            margins = all_links(graph, trace.position)
            number = {agent: member for member, agent in enumerate(graph.agents)}
            for first, second, step in np.concatenate(parts).tolist():
                found.append(sign * float(margins[step, number[first], number[second]]))
    return min(found)


def agrees(case: Case, formula: ir.Formula) -> None:
    """A conjunction of what was chosen is worth exactly what the formula is: no more and no less was chosen."""
    kernel = kernel_of(case, formula)
    values, active, root = values_of(kernel, case.run.mission, case.trace)
    worth = float(np.broadcast_to(values[root], case.trace.position.shape[:2])[0, 0])
    if abs(worth) < UNLIMITED / 2:
        assert least(active, values, case.trace) == pytest.approx(worth, abs=1e-9)
    elif worth > 0:
        assert least(active, values, case.trace) >= UNLIMITED / 2


@settings(max_examples=150)
@given(cases())
def test_what_has_to_hold_is_worth_what_the_formula_is(case: Case) -> None:
    if reference.ahead(case.formula) <= case.run.last:
        agrees(case, case.formula)


@settings(max_examples=150)
@given(cases())
def test_what_has_to_hold_of_a_denied_formula_is_worth_what_it_is(case: Case) -> None:
    if reference.ahead(case.formula) <= case.run.last:
        agrees(case, ir.Apply(by_name["not"], (case.formula,), None, SPAN))


@pytest.mark.parametrize("name", ["reach", "somewhere", "everywhere", "escape", "count", "surround"])
@pytest.mark.parametrize("holds", [True, False])
@settings(max_examples=40)
@given(data=st.data())
def test_what_lengths_of_routes_rest_on_is_worth_what_they_are(data: st.DataObject, name: str, holds: bool) -> None:
    """Five agents strewn over a strip, so that there are routes enough, short ones and long ones."""
    generator = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    places = generator.uniform((0, 0), (3, 1), (5, 2)).tolist()
    mission = mission_of(5, 0)
    graph = data.draw(st.sampled_from(mission.graphs))
    low = data.draw(st.sampled_from([0.0, 0.0, 0.5, 1.5]))
    high = low + data.draw(st.sampled_from([0.5, 1.0, math.inf]))
    operator = by_name[name]
    operands = tuple(data.draw(leaves(5)) for _ in range(operator.arity))
    bounds = ir.Length(graph, Metric.METRES, low, high, SPAN)
    formula: ir.Formula = ir.Apply(operator, operands, bounds, SPAN, ">=", 2)
    if not holds:
        formula = ir.Apply(by_name["not"], (formula,), None, SPAN)
    trace = trace_of([[tuple(place)] for place in places])
    agrees(Case(run_of(mission, trace), trace, formula), formula)


@settings(max_examples=150)
@given(case=cases(), holds=st.booleans(), seed=st.integers(0, 2**32 - 1))
def test_a_motion_nearby_that_has_all_that_was_chosen_satisfies_the_formula(case: Case, holds: bool, seed: int) -> None:
    """What was chosen is enough, not only worth as much; of routes, as long as agents stay about where they were."""
    if reference.ahead(case.formula) > case.run.last:
        return
    formula = case.formula if holds else ir.Apply(by_name["not"], (case.formula,), None, SPAN)
    graph = build(kernel_of(case, formula))
    root, mission = graph.requirements[0].formula, case.run.mission
    values, links = judged(graph, mission, case.trace)
    if float(values[root].flat[0]) <= -UNLIMITED / 2:
        return
    active = activate(postorder(graph.formulas), (root,), values, links, case.trace.position, {})
    moved = case.trace.position + np.random.default_rng(seed).uniform(-0.05, 0.05, case.trace.position.shape)
    nearby = replace(case.trace, position=moved)
    values, _ = judged(graph, mission, nearby)
    assert float(values[root].flat[0]) >= min(least(active, values, nearby), 0.01) - 1e-9


@settings(max_examples=100)
@given(cases())
def test_the_cost_graph_is_worth_what_the_monitor_says(case: Case) -> None:
    if reference.ahead(case.formula) > case.run.last:
        return
    kernel = kernel_of(case, case.formula)
    goal: Goal = kernel.requirements[0]
    values, _, root = values_of(kernel, case.run.mission, case.trace)
    expected = float(robustness(goal.formula, case.run.mission, case.trace)[0, 0])
    worth = float(np.broadcast_to(values[root], case.trace.position.shape[:2])[0, 0])
    assert worth == pytest.approx(np.clip(expected, -UNLIMITED, UNLIMITED), abs=1e-9)


@settings(max_examples=100)
@given(cases())
def test_a_witness_decides_what_the_values_did(case: Case) -> None:
    """What was chosen once is chosen again from the choices alone, whatever the motion has become."""
    if reference.ahead(case.formula) > case.run.last:
        return
    kernel = kernel_of(case, case.formula)
    roots = (build(kernel).requirements[0].formula,)
    steps = case.run.last
    free = Demand.of(case.run.mission, roots, {}, steps)
    chosen = free.active(case.trace.position, case.trace.velocity)
    witness = free.witness(case.trace.position, case.trace.velocity)
    moved = case.trace.position[:, ::-1] + 0.3
    kept = Demand.of(case.run.mission, roots, witness, steps).active(moved, case.trace.velocity)
    open_ = AtLeast | Release | EveryNeighbour | RouteNode
    left_open = any(isinstance(node, open_) for node in free.order)
    if not left_open:
        assert set(kept.margins) == set(chosen.margins)
        assert all(np.array_equal(kept.margins[node], mask) for node, mask in chosen.margins.items())
        assert {graph: links_of(each) for graph, each in kept.joined.items()} == {
            graph: links_of(each) for graph, each in chosen.joined.items()
        }


def links_of(parts: list[Links]) -> set[tuple[int, ...]]:
    return {tuple(link) for link in np.concatenate(parts).tolist()}
