"""Random motions, each with a mission that it satisfies as tightly as possible.

The motion reaches the bounds of the mission: bodies touch each other and static obstacles, and agents have the maximum
and minimum speed. Every feasibility test must accept these missions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Metres, Steps
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir.kernel.nodes import Goal, Kernel, Node
from missionc.ir.kernel.normal_form import negated
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.plan.clearances import check_obstacles, check_separation
from tests.support import random_runs
from tests.support.legal_plans import mission_of, moving, pushed, still, straight, wandering
from tests.support.random_runs import SPAN, as_planned

TOUCHING = 1e-9
"""Reduction of bodies in metres relative to touching ones."""

SHAPES: tuple[ir.Shape, ...] = (
    ir.Box((0.7, 0.6), (1.2, 1.3)),
    ir.Disc((1.7, 0.3), 0.2),
    ir.Difference(ir.Box((-1.0, 1.6), (4.0, 1.9)), ir.Box((0.8, 1.0), (1.4, 2.5))),
    ir.Polygon(((0.2, 0.2), (0.9, 0.4), (0.3, 0.9))),
    ir.Union(ir.Box((0.1, 0.1), (0.4, 1.9)), ir.Box((0.1, 0.1), (1.9, 0.4))),
)


@dataclass(frozen=True)
class Planned:
    """Mission with a plan."""

    mission: ir.Mission
    kernel: Kernel
    trace: Trace


@cache
@st.composite
def on_a_grid(draw: st.DrawFn) -> Planned:
    """Up to three agents that walk on a coarse grid, with every operator and kind of predicate."""
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 5))
    trace = random_runs.trace_of(draw(random_runs.positions(size, steps)))
    mission = random_runs.mission_of(size, steps)
    fastest = float(np.linalg.norm(trace.velocity, axis=-1).max())
    obstacles = draw(st.lists(st.sampled_from(SHAPES), max_size=1))
    mission = _tight(draw, replace(mission, obstacles=tuple(map(still, obstacles))), trace)
    agents = tuple(replace(each, dynamics=ir.SingleIntegrator(max(fastest, 0.1))) for each in mission.agents)
    mission = _with_places(draw, replace(mission, agents=agents), trace)
    return _asked(draw, mission, trace)


@cache
@st.composite
def under_way(draw: st.DrawFn) -> Planned:
    """Up to three agents of any dynamics that wander in a square or a cube, with requirements on their path."""
    seed, steps = draw(st.integers(0, 10_000)), draw(st.integers(1, 8))
    size, dimension = draw(st.integers(1, 3)), draw(st.integers(2, 3))
    step = draw(st.sampled_from([0.5, 1.0, 4.0]))
    kind = draw(st.sampled_from(["single", "double", "unicycle"]))
    generator = np.random.default_rng(seed)
    dynamics: ir.Dynamics
    if kind == "double":
        starts = generator.uniform(3.0, 7.0, (size, dimension))
        push = generator.uniform(-0.3, 0.3, (size, steps, dimension)) / step**2
        trace = pushed(starts, np.zeros((size, dimension)), push, step)
        assume(bool((trace.position > 0).all() and (trace.position < 10).all()))
        speeds = np.linalg.norm(trace.velocity, axis=-1)
        dynamics = ir.DoubleIntegrator(float(speeds.max()) + 0.01, float(np.linalg.norm(push, axis=-1).max()))
    else:
        trace = straight(wandering(seed, size, steps, dimension), step)
        speeds = np.linalg.norm(np.diff(trace.position, axis=1), axis=-1) / step
        if kind == "single" or speeds.min() <= 0:
            dynamics = ir.SingleIntegrator(float(speeds.max()))
        else:
            turned = np.abs((np.diff(trace.heading, axis=1) + math.pi) % (2 * math.pi) - math.pi)
            turn = draw(st.sampled_from([math.inf, float(turned.max(initial=0.0)) / step]))
            dynamics = ir.Unicycle(float(speeds.min()), float(speeds.max()), turn)
    mission = mission_of(trace.position[:, 0].tolist(), steps, step=step, dynamics=dynamics, radius=0.0, separation=0.0)
    shape = _near(draw, dimension)
    offsets = [(0.0,) * dimension, (2.0,) * dimension]
    times = [0.0, step * steps]
    obstacle = draw(st.sampled_from([still(shape), moving(shape, times, offsets), _growing(shape)]))
    mission = _tight(draw, replace(mission, obstacles=(obstacle,)), trace)
    return _asked_of_places(draw, _with_places(draw, mission, trace), trace)


def _near(draw: st.DrawFn, dimension: int) -> ir.Shape:
    corner = draw(st.tuples(*[st.sampled_from([1.0, 4.0, 6.0])] * dimension))
    size = draw(st.tuples(*[st.sampled_from([0.3, 1.0, 2.0])] * dimension))
    box = ir.Box(corner, tuple(low + side for low, side in zip(corner, size, strict=True)))
    hole = ir.Box(tuple(low + side / 4 for low, side in zip(corner, size, strict=True)), (11.0,) * dimension)
    return draw(st.sampled_from([box, ir.Difference(box, hole)]))


def _growing(shape: ir.Shape) -> ir.Obstacle:
    return replace(still(shape), growth=0.05)


def _tight(draw: st.DrawFn, mission: ir.Mission, trace: Trace) -> ir.Mission:
    """Mission with bodies as large as possible, at most half a metre, and with maximum clearances."""
    bare = replace(
        mission,
        agents=tuple(replace(each, radius=Metres(0.0)) for each in mission.agents),
        separation=Metres(0.0),
        clearance=Metres(0.0),
    )
    curves = motion(bare, trace)
    apart = min((check.margin for check in check_separation(bare, curves)), default=1.0)
    clear = min((check.margin for check in check_obstacles(bare, curves)), default=1.0)
    assume(apart >= 0 and clear >= 0.0)
    radius = max(0.0, min(0.5, apart / 2, clear) - TOUCHING)
    share = draw(st.sampled_from([1.0, 0.5]))
    return replace(
        bare,
        agents=tuple(replace(each, radius=Metres(share * radius)) for each in bare.agents),
        separation=Metres(max(0.0, apart - 2 * share * radius - TOUCHING) if apart < 1 else 0.0),
        clearance=Metres(max(0.0, min(clear, 1.0) - share * radius - TOUCHING)),
    )


def _with_places(draw: st.DrawFn, mission: ir.Mission, trace: Trace) -> ir.Mission:
    """Mission with starts and finishes from the motion: points, or regions that it touches; or no finish."""

    def place(agent: int, step: int, kind: str) -> ir.InitialSet | None:
        point = tuple(trace.position[agent, step].tolist())
        if kind == "point":
            return ir.InitialSet(SPAN, point)
        far = tuple(value + 1.0 for value in point)
        return None if kind == "none" else ir.InitialSet(SPAN, region=ir.Region("place", ir.Box(point, far), SPAN))

    start, finish = draw(st.sampled_from(["point", "region"])), draw(st.sampled_from(["point", "region", "none"]))
    agents = []
    for each in mission.agents:
        begin = place(each.index, 0, start)
        assert begin is not None
        agents.append(replace(each, start=begin, finish=place(each.index, -1, finish)))
    return replace(mission, agents=tuple(agents))


def _asked(draw: st.DrawFn, mission: ir.Mission, trace: Trace) -> Planned:
    """Mission with formulas or their negations, whichever holds."""
    size, steps = len(mission.agents), mission.steps
    state = random_runs.remembering(size, steps, random_runs.own_states(size))
    drawn = st.one_of(random_runs.formulas(size, steps, 3), random_runs.formulas(size, steps, 2), state)
    goals: list[Goal] = []
    for number in range(draw(st.integers(1, 3))):
        formula = draw(drawn)
        kernel, _ = expand(replace(mission, requirements=(ir.Requirement(f"r{number}", formula, SPAN),)))
        goals += as_planned(mission, kernel, formula).requirements
    return _true(mission, goals, trace)


def _asked_of_places(draw: st.DrawFn, mission: ir.Mission, trace: Trace) -> Planned:
    """Mission with requirements on places at their times, and on the distance of two agents."""
    goals: list[Goal] = []
    everywhere = [(agent, step) for agent in range(len(mission.agents)) for step in range(mission.steps + 1)]
    for number, (agent, step) in enumerate(draw(st.lists(st.sampled_from(everywhere), min_size=1, max_size=4))):
        point = trace.position[agent, step]
        far = draw(st.sampled_from([-0.2, 0.0, 0.4]))
        corners = np.minimum(point, point + far), np.maximum(point, point + far)
        shape = ir.Box(*(tuple(corner.tolist()) for corner in corners))
        inside = ir.Holds(ir.Inside(ir.Region("here", shape, SPAN), body=False), SPAN)
        other = draw(st.integers(0, len(mission.agents) - 1))
        between = float(np.linalg.norm(point - trace.position[other, step]))
        near = ir.Compare(((-1.0, ir.DistanceBetween(agent, other)),), between, strict=False)
        formula = draw(st.sampled_from([inside, ir.Holds(near, SPAN)])) if other != agent else inside
        at = ir.Apply(random_runs.by_name["eventually"], (formula,), ir.Window(step, step, SPAN), SPAN)
        asked = ir.Requirement(f"r{number}", ir.OfAgent(agent, at, SPAN), SPAN)
        goals += expand(replace(mission, requirements=(asked,)))[0].requirements
    fastest = float(np.linalg.norm(trace.velocity, axis=-1).max())
    slow = ir.Holds(ir.Compare(((-1.0, ir.Speed()),), fastest, strict=False), SPAN)
    always = ir.Apply(random_runs.by_name["always"], (slow,), ir.Window(Steps(0), mission.steps, SPAN), SPAN)
    capped = ir.Requirement("slow", ir.OfAgent(0, always, SPAN), SPAN)
    return _true(mission, [*goals, *expand(replace(mission, requirements=(capped,)))[0].requirements], trace)


def _true(mission: ir.Mission, goals: list[Goal], trace: Trace) -> Planned:
    """Mission with these goals, negated if they do not hold for the motion."""
    judged = monitor(mission, Kernel(tuple(goals), ()), trace)

    def holding(formula: Node, holds: bool) -> Node:
        return formula if holds else negated(formula)

    true = [
        replace(goal, formula=holding(goal.formula, judgement.satisfied))
        for goal, judgement in zip(goals, judged.requirements, strict=True)
    ]
    return Planned(mission, Kernel(tuple(true), ()), trace)
