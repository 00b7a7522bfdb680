"""Hypothesis strategies: small missions, random formulas with every operator, and short runs.

Positions lie on a coarse grid, so that ties (an agent on a border, a link of exactly the radius) come up often.
Regions, graphs and formations depend on the number of agents alone, and so does every strategy: each is made once,
because making one takes longer than drawing from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.choose_backend import needs_of
from missionc.backends.features import Feature
from missionc.base.source import Source, Span
from missionc.base.trace import Trace
from missionc.base.units import Metres, Metric, Seconds, Steps
from missionc.frontend.resolve.lost_agents import without_any
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operator import Bounds, Operator, TooLarge
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.lower.unroll_past import looking_ahead
from tests.reference import Run

SPAN = Span(Source("test.mission", "words"), 0, 5)

BASE = ir.Region("base", ir.Box((0.0, 0.0), (1.0, 1.5)), SPAN)
FIELD = ir.Region("field", ir.Disc((1.5, 1.0), 1.0), SPAN)
WET = ir.Region("wet", ir.Difference(FIELD.shape, BASE.shape), SPAN)
REGIONS = (BASE, FIELD, WET)
MAST = ir.Beacon("mast", (1.0, 0.5), SPAN)


@dataclass(frozen=True)
class Case:
    """Mission without goals, with one run and a formula."""

    run: Run
    trace: Trace
    formula: ir.Formula


def team_of(size: int) -> tuple[ir.Agent, ...]:
    dynamics = ir.SingleIntegrator(10.0)
    start = ir.InitialSet(SPAN, (0.0, 0.0))
    return tuple(
        ir.Agent(index, f"drone[{index}]", "drone", Metres(0.5), dynamics, start, None, Metres(1.0), SPAN)
        for index in range(size)
    )


def mission_of(size: int, steps: int, *requirements: ir.Requirement) -> ir.Mission:
    agents = team_of(size)
    everyone = tuple(range(size))
    return ir.Mission(
        name="random",
        step=Seconds(1.0),
        steps=Steps(steps),
        world=ir.World((0.0, 0.0), (3.0, 3.0), SPAN),
        regions=REGIONS,
        obstacles=(),
        beacons=(MAST,),
        agents=agents,
        teams=(ir.AgentSet("drone", everyone, SPAN),),
        groups=(),
        graphs=graphs_of(size),
        formations=formations_of(size),
        separation=Metres(0.0),
        clearance=Metres(0.0),
        requirements=requirements,
        preferences=(),
        objective=ir.Objective.NONE,
        solve=ir.SolveWith(),
        span=SPAN,
    )


OPAQUE: tuple[ir.Shape, ...] = (ir.Box((0.71, 0.63), (1.23, 1.31)), ir.Disc((1.7, 0.3), 0.21))
"""Shapes whose corners no line between two grid places touches."""


@cache
def graphs_of(size: int) -> tuple[ir.Graph, ...]:
    everyone = tuple(range(size))
    return (
        ir.Proximity("radio", Metres(1.0), everyone, SPAN),
        ir.Proximity("wide", Metres(1.5), everyone[::-1], SPAN),
        ir.Proximity("part", Metres(1.5), everyone[1:], SPAN),
        ir.BeaconCover("cell", Metres(1.0), ((0.5, 0.5), (2.0, 1.0)), everyone, SPAN),
        ir.Sight("eyes", Metres(1.5), OPAQUE, everyone, SPAN),
        ir.Proximity("uneven", Metres(1.0), everyone, SPAN, _ranges(everyone[:1], everyone[1:], 1.5, 0.7)),
        ir.Proximity("star", Metres(0.0), everyone[::-1], SPAN, _ranges(everyone[:1], everyone[1:], 1.5, 1.5)),
        ir.Sight("gaze", Metres(1.5), OPAQUE, everyone, SPAN, ranges=_ranges(everyone[:2], everyone[2:], 1.2, 1.7)),
    )


@cache
def weights_of(size: int) -> tuple[ir.Weight, ...]:
    first, others = frozenset((0,)), frozenset(range(1, size))
    return (
        ir.Weight("cost", 2, ()),
        ir.Weight("delay", 1, (ir.PairWeight(first, others, 3), ir.PairWeight(others, others, 2))),
    )


def _ranges(some: tuple[int, ...], others: tuple[int, ...], there: float, back: float) -> tuple[ir.PairRange, ...]:
    one, other = frozenset(some), frozenset(others)
    return (ir.PairRange(one, other, Metres(there)), ir.PairRange(other, one, Metres(back)))


@cache
def formations_of(size: int) -> tuple[ir.Formation, ...]:
    if size < 2:
        return ()
    edges = tuple(ir.FormationEdge(index, index + 1, 1.0) for index in range(size - 1))
    offset = (ir.FormationEdge(0, size - 1, (1.0, 0.0)),)
    everyone = tuple(range(size))
    return (
        ir.Formation("chain", "chain", everyone, edges, Metres(0.5), False, SPAN),
        ir.Formation("loose", "chain", everyone, edges, Metres(1.0), True, SPAN),
        ir.Formation("pair", "offsets", everyone, offset, Metres(0.5), False, SPAN),
    )


def trace_of(positions: Sequence[Sequence[tuple[float, ...]]]) -> Trace:
    """Trace of positions ``[agent][step]``, straight between steps."""
    position = np.array(positions, dtype=np.float64)
    velocity = np.zeros_like(position)
    if position.shape[1] > 1:
        velocity[:, :-1] = position[:, 1:] - position[:, :-1]
        velocity[:, -1] = velocity[:, -2]
    return Trace(Seconds(1.0), position, velocity, np.zeros(position.shape[:2]))


def run_of(mission: ir.Mission, trace: Trace) -> Run:
    return Run(
        mission,
        [[tuple(point) for point in agent] for agent in trace.position.tolist()],
        [[tuple(point) for point in agent] for agent in trace.velocity.tolist()],
        trace.heading.tolist(),
    )


@cache
def positions(size: int, steps: int) -> st.SearchStrategy[list[list[tuple[float, ...]]]]:
    """Positions of each agent at each step, on the grid."""
    coordinate = st.sampled_from([0.0, 0.5, 1.0, 1.5, 2.0])
    places = st.lists(st.tuples(coordinate, coordinate), min_size=steps + 1, max_size=steps + 1)
    return st.lists(places, min_size=size, max_size=size)


@cache
@st.composite
def cases(draw: st.DrawFn, first: Operator | None = None) -> Case:
    """Run of up to 4 agents and 6 steps, with a formula; with ``first``, one with that outermost operator."""
    size, steps = draw(st.integers(1, 4)), draw(st.integers(1, 6))
    trace = trace_of(draw(positions(size, steps)))
    formula = draw(formulas(size, steps, 3)) if first is None else draw(applied(first, size, steps, 2))
    return Case(run_of(mission_of(size, steps), trace), trace, formula)


def as_planned(mission: ir.Mission, kernel: Kernel, formula: ir.Formula) -> Kernel:
    """Kernel in the planners' form for a single formula; unsupported formulas are dropped."""
    assume(all(need.feature is not Feature.PAST_BELOW_METRES for need in needs_of(formula)))
    ahead = looking_ahead(mission, kernel, 1_000_000)
    assert not isinstance(ahead, TooLarge)
    return ahead


@cache
@st.composite
def snapshots(draw: st.DrawFn, operator: Operator) -> Case:
    """Four agents on a strip at one step, and a spatial operator with simple operands and a lower bound."""
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    places = [(x / 4, y / 4) for x, y in generator.integers((0, 0), (13, 4), (4, 2)).tolist()]
    graph = draw(st.sampled_from(graphs_of(4)[:2]))
    metric = draw(st.sampled_from(Metric))
    low = draw(st.sampled_from([0.5, 1.0, 2.0])) if metric is Metric.METRES else draw(st.integers(1, 3))
    weight = draw(st.sampled_from(weights_of(4))) if metric is Metric.WEIGHT else None
    bounds = ir.Length(graph, metric, float(low), low + draw(st.sampled_from([0.0, 1.0, math.inf])), SPAN, weight)
    operands = tuple(draw(leaves(4)) for _ in range(operator.arity))
    formula = ir.Apply(operator, operands, bounds, SPAN, ">=", draw(st.integers(1, 2)))
    trace = trace_of([[place] for place in places])
    return Case(run_of(mission_of(4, 0), trace), trace, formula)


@cache
def formulas(size: int, budget: int, depth: int) -> st.SearchStrategy[ir.Formula]:
    """Formulas that look at most ``budget`` steps ahead."""
    if depth == 0:
        return leaves(size)
    operators = st.sampled_from(OPERATORS).flatmap(lambda one: applied(one, size, budget, depth))
    return st.one_of(leaves(size), operators, quantified(size, budget, depth))


@cache
@st.composite
def quantified(draw: st.DrawFn, size: int, budget: int, depth: int) -> ir.Formula:
    body = draw(formulas(size, budget, depth - 1))
    if size > 1 and draw(st.integers(0, 3)) == 0:
        anybody = ir.AgentSet("these", tuple(range(draw(st.integers(1, size)))), SPAN)
        kind = draw(st.sampled_from(["every", "some"]))
        whole = ir.AtLeastOf(kind, len(anybody.agents) if kind == "every" else 1, anybody, body, SPAN)
        found, named = without_any(draw(st.integers(1, min(2, len(anybody.agents)))), anybody, whole, SPAN)
        return whole if named else found
    if draw(st.booleans()):
        return ir.OfAgent(draw(st.integers(0, size - 1)), body, SPAN)
    kind = draw(st.sampled_from(["every", "some", "at least"]))
    members = tuple(range(draw(st.integers(1, size))))
    number = {"every": len(members), "some": 1}.get(kind) or draw(st.integers(0, size + 1))
    return ir.AtLeastOf(kind, number, ir.AgentSet("these", members, SPAN), body, SPAN)


@cache
@st.composite
def applied(draw: st.DrawFn, operator: Operator, size: int, budget: int, depth: int) -> ir.Formula:
    bounds: ir.Window | ir.Length | ir.Period | None = None
    if operator.name == "next":
        if budget == 0:
            return draw(leaves(size))
        budget -= 1
    elif operator.bounds is Bounds.TIME:
        low = draw(st.integers(0, budget))
        if draw(st.booleans()):
            high = draw(st.integers(low, budget))
            bounds, budget = ir.Window(Steps(low), Steps(high), SPAN), budget - high
        else:
            bounds, budget = ir.Window(Steps(low), None, SPAN), 0
    elif operator.bounds is Bounds.PERIOD:
        if budget == 0:
            return draw(leaves(size))
        bounds, budget = ir.Period(Steps(draw(st.integers(1, budget))), SPAN), 0
    elif operator.bounds is Bounds.PAST:
        low = draw(st.integers(0, 3))
        bounds = ir.Window(Steps(low), Steps(low + draw(st.integers(0, 4))), SPAN)
    elif operator.bounds is Bounds.LENGTH:
        bounds = draw(lengths(size))
    budgets = [budget] * operator.arity
    if operator.name in ("until", "release") and isinstance(bounds, ir.Window) and bounds.high != 0:
        # The left side is evaluated up to the step before the last one of the window.
        budgets[0] += 1
    operands = tuple(draw(formulas(size, each, depth - 1)) for each in budgets)
    if operator.name == "count":
        comparison = draw(st.sampled_from([">=", ">", "<", "<=", "="]))
        return ir.Apply(operator, operands, bounds, SPAN, comparison, draw(st.integers(0, 3)))
    return ir.Apply(operator, operands, bounds, SPAN)


@cache
@st.composite
def lengths(draw: st.DrawFn, size: int) -> ir.Length:
    graph = draw(st.sampled_from(graphs_of(size)))
    if draw(st.booleans()):
        low = draw(st.integers(0, 3))
        high = draw(st.one_of(st.just(math.inf), st.integers(low, low + 3).map(float)))
        if draw(st.integers(0, 3)) == 0:
            return ir.Length(graph, Metric.WEIGHT, float(low), high, SPAN, draw(st.sampled_from(weights_of(size))))
        return ir.Length(graph, Metric.HOPS, float(low), high, SPAN)
    near = draw(st.sampled_from([0.0, 0.0, 0.5, 1.0, 1.5, 2.5]))
    far = draw(st.one_of(st.just(math.inf), st.sampled_from([0.0, 0.5, 1.0, 2.0]).map(lambda more: near + more)))
    return ir.Length(graph, Metric.METRES, near, far, SPAN)


@cache
def leaves(size: int) -> st.SearchStrategy[ir.Formula]:
    members = st.lists(st.integers(0, size - 1), min_size=1, max_size=size, unique=True).map(tuple)
    predicates: list[st.SearchStrategy[ir.Predicate]] = [
        st.builds(ir.Inside, st.sampled_from(REGIONS), st.booleans()),
        st.builds(ir.Touches, st.sampled_from(REGIONS)),
        comparisons(size),
        st.builds(ir.Connected, st.just(graphs_of(size)[0]), members),
        st.builds(
            lambda agents, order: ir.Connected(graphs_of(size)[0], agents, min(order, max(len(agents) - 1, 1))),
            members,
            st.integers(2, 3),
        ),
    ]
    if formations_of(size):
        predicates.append(st.builds(ir.InFormation, st.sampled_from(formations_of(size))))
    return st.one_of(
        st.one_of(predicates).map(lambda predicate: ir.Holds(predicate, SPAN)),
        members.map(lambda agents: ir.Belongs(ir.AgentSet("these", agents, SPAN), SPAN)),
        st.booleans().map(lambda value: ir.Truth(value, SPAN)),
    )


@cache
def flags_of(size: int) -> tuple[ir.Flag, ...]:
    everyone = tuple(range(size))
    return (
        ir.Flag("loaded", everyone, BASE, FIELD, SPAN),
        ir.Flag("seen", everyone[1:], FIELD, None, SPAN),
        ir.Flag("odd", everyone, WET, WET, SPAN),
    )


@cache
def resources_of(size: int) -> tuple[ir.Resource, ...]:
    everyone, refills = tuple(range(size)), (ir.Refill(BASE, 2.0), ir.Refill(WET, 1.0))
    return (
        ir.Resource("battery", everyone, 4.0, 6.0, 0.5, 1.0, refills, SPAN),
        ir.Resource("fuel", everyone, 3.0, 3.0, 1.0, 0.0, (ir.Refill(FIELD, 3.0),), SPAN),
    )


@cache
def own_states(size: int) -> st.SearchStrategy[ir.Formula]:
    """Predicates that depend on an agent's earlier steps."""
    place = st.builds(ir.DistanceTo, st.sampled_from(REGIONS))
    level = st.builds(ir.Level, st.sampled_from(resources_of(size)))
    terms = st.lists(
        st.tuples(st.sampled_from([1.0, -1.0, 2.0]), st.one_of(level, level, place)), min_size=1, max_size=2
    )
    compared = st.builds(ir.Compare, terms.map(tuple), st.sampled_from([-3.0, -1.5, 0.0, 2.0]), st.booleans())
    predicates = st.one_of(st.builds(ir.Flagged, st.sampled_from(flags_of(size))), compared)
    return predicates.map(lambda predicate: ir.Holds(predicate, SPAN))


@cache
@st.composite
def remembering(draw: st.DrawFn, size: int, budget: int, leaf: st.SearchStrategy[ir.Formula]) -> ir.Formula:
    """Temporal operator over predicates, of which one depends on earlier steps."""
    word = draw(st.sampled_from(["always", "eventually", "until", "release"]))
    low = draw(st.integers(0, budget))
    window = ir.Window(Steps(low), Steps(draw(st.integers(low, budget))), SPAN)
    first, other = draw(leaf), draw(st.one_of(leaf, leaves(size)))
    operator = by_name[word]
    return ir.Apply(operator, (first, other)[: operator.arity], window, SPAN)


@cache
def comparisons(size: int) -> st.SearchStrategy[ir.Compare]:
    agent = st.integers(0, size - 1)
    features: st.SearchStrategy[ir.Feature] = st.one_of(
        st.builds(ir.Coordinate, st.integers(0, 1)),
        st.builds(ir.Speed),
        st.builds(ir.Altitude),
        st.builds(ir.DistanceTo, st.one_of(st.sampled_from(REGIONS), st.just(MAST), agent)),
        st.builds(ir.DistanceBetween, agent, agent),
    )
    terms = st.lists(st.tuples(st.sampled_from([1.0, -1.0, 2.0]), features), min_size=1, max_size=2).map(tuple)
    return st.builds(ir.Compare, terms, st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]), st.booleans())
