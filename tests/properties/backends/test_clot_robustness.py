"""The transport planner's robustness in torch against the reference, the monitor, and motions judged one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import minimum_spanning_tree

from missionc import ir
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.base.trace import Array, Trace
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Is,
    NeighbourNode,
    Node,
    Not,
    Release,
    RouteNode,
    Until,
)
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.margins.predicate_margins import margin
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.language.walk_formulas import asks_the_past, formulas_bottom_up
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import robustness
from tests import reference
from tests.support.random_runs import SPAN, Case, as_planned, cases, leaves, mission_of, snapshots, trace_of

torch = pytest.importorskip("torch")

from missionc.backends.clot.paper.leaf_margins import UNLIMITED, bottleneck
from missionc.backends.clot.paper.leaf_margins import margin as margin_in_torch
from missionc.backends.clot.paper.motion_batch import States, team, velocities
from missionc.backends.clot.paper.paper_rules import PaperRules
from missionc.backends.clot.paper.robustness import Robustness, over, until
from missionc.backends.clot.paper.sparsity_pattern import sparsity_pattern
from missionc.ir.language.margins.connected import spanning_tree

torch.set_num_threads(1)
seeds = st.integers(0, 2**32 - 1)
SPATIAL = [operator for operator in OPERATORS if operator.spatial]


def node_of(mission: ir.Mission, formula: ir.Formula) -> Node:
    kernel, findings = expand(replace(mission, requirements=(ir.Requirement("asked", formula, SPAN),)))
    assert kernel is not None, findings
    return build(as_planned(mission, kernel, formula)).requirements[0].formula


def denied(formula: ir.Formula) -> ir.Formula:
    return ir.Apply(by_name["not"], (formula,), None, SPAN)


def states_of(*traces: Trace) -> States:
    return States(
        *(torch.tensor(np.stack([getattr(trace, name) for trace in traces])) for name in ("position", "velocity"))
    )


def values_of(mission: ir.Mission, node: Node, states: States) -> Array:
    """The node's value everywhere: (batch, agents, steps)."""
    evaluation = Robustness(team(mission, dtype=torch.float64), states)
    return evaluation.values(postorder([node]))[node].expand(states.position.shape[:3]).numpy()


def agrees(case: Case, formula: ir.Formula) -> None:
    mission = case.run.mission
    node = node_of(mission, formula)
    found = values_of(mission, node, states_of(case.trace))[0]
    kernel, _ = expand(replace(mission, requirements=(ir.Requirement("asked", formula, SPAN),)))
    assert kernel is not None
    monitored = robustness(kernel.requirements[0].formula, mission, case.trace)
    number = reference.Meaning(case.run, number=True)
    # What looks back is spelt out for where it is asked, at step 0.
    last = 1 if any(map(asks_the_past, formulas_bottom_up([formula]))) else case.run.last + 1
    last = min(last, case.run.last + 1 - reference.ahead(formula))
    for agent in range(len(found)):
        for step in range(last):
            expected = max(-UNLIMITED, min(UNLIMITED, number.of(formula, agent, step)))
            assert math.isclose(found[agent, step], expected, rel_tol=0.0, abs_tol=1e-9), (agent, step)
            clipped = max(-UNLIMITED, min(UNLIMITED, monitored[agent, step]))
            assert math.isclose(found[agent, step], clipped, rel_tol=0.0, abs_tol=1e-9), (agent, step)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=15)
@given(data=st.data())
def test_an_operator_is_worth_what_the_reference_and_the_monitor_say(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(cases(operator))
    agrees(case, case.formula)
    agrees(case, denied(case.formula))


@pytest.mark.parametrize("operator", SPATIAL, ids=lambda operator: operator.name)
@settings(max_examples=15)
@given(data=st.data())
def test_a_route_with_a_lower_bound_is_worth_what_the_reference_says(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(snapshots(operator))
    agrees(case, case.formula)
    agrees(case, denied(case.formula))


@given(cases())
def test_any_formula_is_worth_what_the_reference_says(case: Case) -> None:
    agrees(case, case.formula)


@settings(max_examples=25)
@given(cases(), seeds)
def test_a_batch_is_worth_what_its_motions_are(case: Case, seed: int) -> None:
    mission, node = case.run.mission, node_of(case.run.mission, case.formula)
    places = np.random.default_rng(seed).uniform(0.0, 2.0, (3, *case.trace.position.shape))
    traces = [case.trace, *(trace_of(each.tolist()) for each in places)]
    together = values_of(mission, node, states_of(*traces))
    for index, trace in enumerate(traces):
        assert np.array_equal(together[index], values_of(mission, node, states_of(trace))[0])


steps = st.integers(1, 20)
bounds = st.tuples(st.integers(0, 22), st.one_of(st.none(), st.integers(0, 22))).map(
    lambda pair: (pair[0], None if pair[1] is None else pair[0] + pair[1])
)


def window_of(low: int, high: int | None, step: int, last: int) -> range:
    """The steps of a window; none where it runs past the last step or starts after it."""
    end = last if high is None else step + high
    return range(step + low, end + 1) if step + low <= end <= last else range(0)


@given(steps, bounds, seeds)
def test_windows_are_their_definitions(count: int, window: tuple[int, int | None], seed: int) -> None:
    hold, end = np.random.default_rng(seed).uniform(-9, 9, (2, 2, count))
    greatest = over(torch.tensor(end), *window, -UNLIMITED).numpy()
    freed = until(torch.tensor(hold), torch.tensor(end), *window).numpy()
    for agent in range(2):
        for step in range(count):
            inside = window_of(*window, step, count - 1)
            assert greatest[agent, step] == max((end[agent, later] for later in inside), default=-UNLIMITED)
            assert freed[agent, step] == max(
                (min([end[agent, later], *hold[agent, step:later]]) for later in inside), default=-UNLIMITED
            )


@given(st.integers(1, 7), st.integers(0, 6), seeds)
def test_until_and_release_reach_to_the_end_of_the_mission(count: int, low: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    low = min(low, count - 1)
    trace = trace_of(generator.uniform(0, 2, (2, count, 2)).tolist())
    mission = mission_of(2, count - 1)
    first, second = (node_of(mission, ir.Holds(ir.Inside(region, False), SPAN)) for region in mission.regions[:2])
    states = states_of(trace)
    hold, end = (values_of(mission, node, states)[0] for node in (first, second))
    freed = values_of(mission, Until(first, second, low, None), states)[0]
    held = values_of(mission, Release(first, second, low, None), states)[0]
    for agent in range(2):
        later = range(low, count)
        assert freed[agent, 0] == max(min([end[agent, step], *hold[agent, :step]]) for step in later)
        assert held[agent, 0] == min(max([end[agent, step], *hold[agent, :step]]) for step in later)


# ------------------------------------------------------------------ leaves


@given(st.data(), seeds)
def test_a_margin_in_torch_is_the_margin(data: st.DataObject, seed: int) -> None:
    size = data.draw(st.integers(1, 4))
    mission = mission_of(size, 3)
    leaf = data.draw(leaves(size).filter(lambda formula: isinstance(formula, ir.Holds)))
    trace = trace_of((np.random.default_rng(seed).integers(0, 9, (size, 4, 2)) / 4).tolist())
    expected = np.clip(np.atleast_2d(margin(leaf.predicate, mission, trace)), -UNLIMITED, UNLIMITED)
    found = margin_in_torch(leaf.predicate, team(mission, dtype=torch.float64), states_of(trace))
    assert found.shape == (1, *expected.shape)
    assert np.allclose(found[0].numpy(), expected, rtol=0.0, atol=1e-12)


@given(st.integers(1, 6), st.integers(1, 4), seeds)
def test_the_spanning_tree_has_the_shortest_longest_edge(members: int, graphs: int, seed: int) -> None:
    places = np.random.default_rng(seed).uniform(0, 9, (graphs, members, 2))
    lengths = np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)
    worst = bottleneck(torch.tensor(-lengths)).numpy()
    first, second, _ = spanning_tree(-lengths)
    assert first.shape == second.shape == (graphs, members - 1)
    for index in range(graphs):
        tree = minimum_spanning_tree(lengths[index])
        assert worst[index] == (-tree.data.max() if members > 1 else UNLIMITED)
        edges = lengths[index, first[index], second[index]]
        assert math.isclose(edges.sum(), tree.sum(), abs_tol=1e-9)
        assert {0, *second[index].tolist()} == set(range(members))


# --------------------------------------------------- one waypoint is moved


def moved_motions(position: torch.Tensor, agent: int, probes: torch.Tensor) -> torch.Tensor:
    """Every motion with one waypoint moved: (batch, waypoints, directions, agents, steps, dim)."""
    _, steps, directions, _ = probes.shape
    moved = position[:, None, None].repeat(1, steps, directions, 1, 1, 1)
    for step in range(steps):
        moved[:, step, :, agent, step] = probes[:, step]
    return moved


# -------------------------------------------------------- the paper's rules


class Slow:
    """The paper's four rules on the tree of a formula, one waypoint and one direction at a time.

    ``usual`` and ``moved`` are the values of every node, (agents, steps), on the motion and on the moved one.
    """

    def __init__(
        self, usual: dict[Node, Array], moved: dict[Node, Array], agent: int, waypoint: int, last: int
    ) -> None:
        self.usual, self.moved, self.agent, self.waypoint, self.last = usual, moved, agent, waypoint, last

    def of(self, node: Node, agent: int, step: int) -> tuple[float, bool, bool]:
        """Value, whether the waypoint is read, whether it is a leaf: a formula of one moment."""
        match node:
            case Atom(predicate) | Not(Atom(predicate)):
                read = reads(predicate, agent, step, self.agent, self.waypoint, self.last)
                return float((self.moved if read else self.usual)[node][agent, step]), read, True
            case Is() | Not():
                return float(self.usual[node][agent, step]), False, True
            case At(other, body):
                return self.of(body, other, step)
            case All(parts) | Any(parts):
                each = [self.of(part, agent, step) for part in parts]
                if all(leaf for _, _, leaf in each):
                    values, every = [value for value, _, _ in each], isinstance(node, All)
                    value = min(values, default=UNLIMITED) if every else max(values, default=-UNLIMITED)
                    return value, any(read for _, read, _ in each), True
                return self.both(each) if isinstance(node, All) else self.either(each)
            case Always(body, low, high):
                return self.both([self.of(body, agent, later) for later in self.window(low, high, step)])
            case Eventually(body, low, high):
                return self.either([self.of(body, agent, later) for later in self.window(low, high, step)])
            case Until(hold, end, low, high):
                window = self.window(low, high, step)
                value = self.either([self.of(end, agent, window[-1])])
                for here in reversed(range(step, window[-1])):
                    value = self.both([self.of(hold, agent, here), value])
                    if here in window:
                        value = self.either([self.of(end, agent, here), value])
                return value
            case Release(free, end, low, high):
                window = self.window(low, high, step)
                value = self.both([self.of(end, agent, window[-1])])
                for here in reversed(range(step, window[-1])):
                    value = self.either([self.of(free, agent, here), value])
                    if here in window:
                        value = self.both([self.of(end, agent, here), value])
                return value
        raise AssertionError(node)

    def window(self, low: int, high: int | None, step: int) -> range:
        return range(step + low, (self.last if high is None else step + high) + 1)

    def both(self, parts: list[tuple[float, bool, bool]]) -> tuple[float, bool, bool]:
        values = [value for value, _, _ in parts]
        passed = [value for value, read, leaf in parts if read and leaf]
        limited = [value for value in values if abs(value) < UNLIMITED]
        nonzero = any(read for _, read, _ in parts)
        if passed:
            return min(passed), True, False
        if not nonzero or not limited or min(values) <= -UNLIMITED:
            return min(values, default=UNLIMITED), nonzero, False
        return sum(limited) / len(limited), True, False

    def either(self, parts: list[tuple[float, bool, bool]]) -> tuple[float, bool, bool]:
        return max((value for value, _, _ in parts), default=-UNLIMITED), any(read for _, read, _ in parts), False


def reads(predicate: ir.Predicate, agent: int, step: int, moved: int, waypoint: int, last: int) -> bool:
    """Whether a predicate, asked of an agent at a step, looks at the moved agent's waypoint."""
    if isinstance(predicate, ir.Inside | ir.Touches):
        return agent == moved and step == waypoint
    if isinstance(predicate, ir.Connected):
        return step == waypoint and moved in predicate.agents
    if isinstance(predicate, ir.InFormation):
        return step == waypoint and any(moved in (edge.first, edge.second) for edge in predicate.formation.edges)
    assert isinstance(predicate, ir.Compare)
    looks = False
    for _, feature in predicate.terms:
        if isinstance(feature, ir.DistanceBetween):
            looks |= step == waypoint and moved in (feature.first, feature.second)
        elif isinstance(feature, ir.Speed):
            looks |= agent == moved and waypoint in ((step, step + 1) if step < last else (step - 1, step))
        else:
            looks |= agent == moved and step == waypoint
            looks |= isinstance(feature, ir.DistanceTo) and feature.target == moved and step == waypoint
    return looks


def by_the_rules(mission: ir.Mission, goal: Node, position: torch.Tensor, agent: int, probes: torch.Tensor) -> None:
    size, count = position.shape[1:3]
    crew = team(mission, dtype=torch.float64)
    found = PaperRules(sparsity_pattern([goal], agent, size, count), crew, position, probes).goals()[0]
    order = postorder([goal])

    def values(motion: torch.Tensor) -> dict[Node, Array]:
        found = Robustness(crew, States(motion, velocities(motion, mission.step))).values(order)
        return {node: value.expand(len(motion), size, count)[0].numpy() for node, value in found.items()}

    motions = moved_motions(position, agent, probes)
    for batch, waypoint, direction in np.ndindex(*found.shape):
        usual, moved = values(position[batch : batch + 1]), values(motions[batch, waypoint, direction][None])
        slow = Slow(usual, moved, agent, waypoint, count - 1)
        expected, nonzero, _ = slow.of(goal, 0, 0)
        if not nonzero:
            assert math.isclose(expected, usual[goal][0, 0], abs_tol=1e-9)
        assert math.isclose(found[batch, waypoint, direction], expected, abs_tol=1e-9), (waypoint, direction)


@settings(max_examples=60)
@given(st.data(), seeds, st.integers(0, 3))
def test_the_four_rules_are_what_they_say(data: st.DataObject, seed: int, agent: int) -> None:
    plain = [operator for operator in OPERATORS if not operator.spatial and operator.name != "count"]
    case = data.draw(cases(data.draw(st.sampled_from(plain))))
    node = node_of(case.run.mission, case.formula)
    beyond = AtLeast | NeighbourNode | RouteNode
    assume(not any(isinstance(one, beyond) for one in postorder([node])))
    size, count, _ = case.trace.position.shape
    generator = np.random.default_rng(seed)
    probes = torch.tensor(generator.uniform(0, 2, (1, count, 2, 2)))
    position = torch.tensor(case.trace.position)[None]
    goal = At(int(generator.integers(size)), node)
    by_the_rules(case.run.mission, goal, position, agent % size, probes)


@settings(max_examples=20)
@given(seeds)
def test_a_window_over_a_disjunction_of_one_moment_passes_on_the_waypoints_moment(seed: int) -> None:
    """G[1,4] (a or (b and c)), each waypoint moved in turn."""
    mission, count = mission_of(1, 6), 7
    a, b, c = (Atom(ir.Inside(region, False)) for region in mission.regions)
    moment = Any((a, All((b, c))))
    goal = Always(moment, 1, 4)
    generator = np.random.default_rng(seed)
    position = torch.tensor(generator.uniform(0, 2, (1, 1, count, 2)))
    probes = torch.tensor(generator.uniform(0, 2, (1, count, 3, 2)))
    crew = team(mission, dtype=torch.float64)
    found = PaperRules(sparsity_pattern([goal], 0, 1, count), crew, position, probes).goals()[0, 0]
    usual = Robustness(crew, States(position, torch.zeros_like(position))).values(postorder([goal]))[goal][0, 0, 0]
    for moved, direction in np.ndindex(count, 3):
        one = probes[:, None, moved : moved + 1, direction]
        here = Robustness(crew, States(one, torch.zeros_like(one))).values(postorder([moment]))[moment][0, 0, 0]
        assert math.isclose(found[moved, direction], here if 1 <= moved <= 4 else usual, abs_tol=1e-9)
    by_the_rules(mission, goal, position, 0, probes)


@settings(max_examples=20)
@given(seeds)
def test_the_four_rules_on_the_formula_of_the_papers_second_figure(seed: int) -> None:
    """(G[2,5] a) and (F[0,2] G[0,2] b) and (c U[0,3] d), each waypoint moved in turn."""
    mission, count = mission_of(1, 6), 7
    a, b, c = (Atom(ir.Inside(region, False)) for region in mission.regions)
    d = Atom(ir.Touches(mission.regions[0]))
    goal = All((Always(a, 2, 5), Eventually(Always(b, 0, 2), 0, 2), Until(c, d, 0, 3)))
    generator = np.random.default_rng(seed)
    position = torch.tensor(generator.uniform(0, 2, (1, 1, count, 2)))
    probes = torch.tensor(generator.uniform(0, 2, (1, count, 4, 2)))
    crew = team(mission, dtype=torch.float64)
    found = PaperRules(sparsity_pattern([goal], 0, 1, count), crew, position, probes).goals()[0, 0]

    def leaf(node: Atom, place: torch.Tensor) -> float:
        one = States(place.reshape(1, 1, 1, 2), torch.zeros(1, 1, 1, 2))
        return float(margin_in_torch(node.predicate, crew, one))

    for moved, direction in np.ndindex(count, 4):
        places = position[0, 0].clone()
        places[moved] = probes[0, moved, direction]
        fa, fb, fc, fd = ([leaf(node, place) for place in places] for node in (a, b, c, d))
        always = fa[moved] if 2 <= moved <= 5 else min(fa[2:6])
        eventually = max(fb[moved] if s <= moved <= s + 2 else min(fb[s : s + 3]) for s in (0, 1, 2))
        freed = fd[3]
        for step in (2, 1, 0):
            if moved == step:
                held = fc[step]
            elif step < moved <= 3:
                held = (fc[step] + freed) / 2
            else:
                held = min(fc[step], freed)
            freed = max(fd[step], held)
        expected = (always + eventually + freed) / 3 if moved <= 5 else min(always, eventually, freed)
        assert math.isclose(found[moved, direction], expected, abs_tol=1e-9), (moved, direction)
    by_the_rules(mission, goal, position, 0, probes)
