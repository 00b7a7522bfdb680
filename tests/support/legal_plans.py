"""Hand-made missions with legal plans, for tests of evaluation, drawing and writing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from missionc import ir
from missionc.base.source import Source, Span
from missionc.base.trace import Plan, Trace
from missionc.base.units import Metres, Seconds, Steps
from missionc.ir.kernel.nodes import Kernel

Array = NDArray[np.float64]

SPAN = Span(Source("test.mission", "words"), 0, 5)
NOTHING = Kernel((), ())
"""Kernel of a mission without requirements."""

WALKER = ir.SingleIntegrator(2.0)


def mission_of(
    starts: Sequence[Sequence[float]],
    steps: int,
    *,
    step: float = 1.0,
    dynamics: ir.Dynamics = WALKER,
    radius: float = 0.1,
    separation: float = 0.1,
    clearance: float = 0.0,
    obstacles: Sequence[ir.Obstacle] = (),
    size: float = 10.0,
    altitude: float = 1.0,
) -> ir.Mission:
    """Team ``drone`` with these starts in a square or cubic world."""
    dimension = len(starts[0])
    agents = tuple(
        ir.Agent(
            index,
            f"drone[{index}]",
            "drone",
            Metres(radius),
            dynamics,
            ir.InitialSet(SPAN, tuple(float(value) for value in start)),
            None,
            Metres(altitude),
            SPAN,
        )
        for index, start in enumerate(starts)
    )
    everyone = tuple(range(len(agents)))
    return ir.Mission(
        name="made",
        step=Seconds(step),
        steps=Steps(steps),
        world=ir.World((0.0,) * dimension, (size,) * dimension, SPAN),
        regions=(),
        obstacles=tuple(obstacles),
        beacons=(),
        agents=agents,
        teams=(ir.AgentSet("drone", everyone, SPAN),),
        groups=(),
        graphs=(ir.Proximity("radio", Metres(2.0), everyone, SPAN),),
        formations=(),
        separation=Metres(separation),
        clearance=Metres(clearance),
        requirements=(),
        preferences=(),
        objective=ir.Objective.NONE,
        solve=ir.SolveWith(),
        span=SPAN,
    )


def straight(position: Array | Sequence[Sequence[Sequence[float]]], step: float = 1.0) -> Trace:
    """Trace through positions (agents, steps + 1, dim) in metres, straight between them, heading along the motion."""
    places = np.asarray(position, dtype=np.float64)
    moves = np.diff(places, axis=1) / step
    velocity = np.concatenate([moves, moves[:, -1:]], axis=1)
    return Trace(Seconds(step), places, velocity, np.arctan2(velocity[..., 1], velocity[..., 0]))


def pushed(start: Array, velocity: Array, acceleration: Array, step: float) -> Trace:
    """Trace of double integrators: (agents, dim) m and m/s, and accelerations (agents, steps, dim), m/s²."""
    positions, velocities = [start], [velocity]
    for push in np.swapaxes(acceleration, 0, 1):
        positions.append(positions[-1] + velocities[-1] * step + push * step**2 / 2)
        velocities.append(velocities[-1] + push * step)
    speed = np.stack(velocities, axis=1)
    return Trace(Seconds(step), np.stack(positions, axis=1), speed, np.arctan2(speed[..., 1], speed[..., 0]))


def wandering(seed: int, agents: int, steps: int, dimension: int = 2, need: float = 0.3, fastest: float = 1.5) -> Array:
    """Random walks (agents, steps + 1, dim) in a world of 10 m with distances of at least ``need`` metres."""
    generator = np.random.default_rng(seed)
    paths = [_scattered(generator, agents, dimension, need)]
    while len(paths) <= steps:
        goals = paths[-1].copy()
        for agent in range(agents):
            for _ in range(50):
                way = generator.normal(size=dimension)
                goal = paths[-1][agent] + way / np.linalg.norm(way) * generator.uniform(0.3, fastest)
                if (goal < 0.2).any() or (goal > 9.8).any():
                    continue
                if all(_apart(paths[-1], goals, agent, goal, other) >= need for other in range(agents)):
                    goals[agent] = goal
                    break
        # Agents without a path wait, and may block others.
        if all(
            _apart(paths[-1], goals, one, goals[one], other) >= need for one in range(agents) for other in range(one)
        ):
            paths.append(goals)
    return np.stack(paths, axis=1)


def _scattered(generator: np.random.Generator, agents: int, dimension: int, need: float) -> Array:
    places: list[Array] = []
    while len(places) < agents:
        place = generator.uniform(0.5, 9.5, dimension)
        if all(float(np.linalg.norm(place - other)) > need for other in places):
            places.append(place)
    return np.stack(places)


def _apart(places: Array, goals: Array, agent: int, goal: Array, other: int) -> float:
    if other == agent:
        return math.inf
    shares = np.linspace(0, 1, 101)[:, None]
    between = places[agent] - places[other] + shares * ((goal - places[agent]) - (goals[other] - places[other]))
    # Sampling a little finer than the need is exact.
    return float(np.linalg.norm(between, axis=-1).min()) - 1e-3


def planned(mission: ir.Mission, trace: Trace) -> Plan:
    return Plan(mission.name, "smt", 0, trace, ())


def still(shape: ir.Shape, name: str = "wall") -> ir.Obstacle:
    return ir.Obstacle(name, shape, ir.Still(), SPAN)


def moving(shape: ir.Shape, times: Sequence[float], offsets: Sequence[ir.Vector], name: str = "truck") -> ir.Obstacle:
    return ir.Obstacle(name, shape, ir.Path(tuple(Seconds(time) for time in times), tuple(offsets)), SPAN)


def moved(trace: Trace, agent: int, step: int, by: Sequence[float]) -> Trace:
    """Trace with one agent moved at one step."""
    position = trace.position.copy()
    position[agent, step] += np.asarray(by)
    return replace(trace, position=position)
