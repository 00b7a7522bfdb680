"""Small random missions, valid and hard to turn into flights.

Static and moving obstacles, which may sweep over the start, are among one to four agents of one or two kinds, in a
plane or a volume, sometimes without any clearance.
"""

from __future__ import annotations

import numpy as np

SIDE, HEIGHT = 6.0, 3.0
"""Size of the world, metres."""
BASE = 1.8
"""Side of the start in metres, a square in the world's corner without obstacles at first."""


def random_mission(generator: np.random.Generator) -> str:
    """Text of a mission, sometimes provably impossible for `check`.

    The same generator gives the same text.
    """
    volume = bool(generator.random() < 0.3)
    step, steps = _one(generator, [0.5, 1.0, 1.0, 2.0]), int(generator.integers(5, 11))
    horizon = step * steps
    far = (SIDE, SIDE, HEIGHT) if volume else (SIDE, SIDE)
    lines = [
        "mission random_",
        f"time step {step:g} s, horizon {horizon:g} s",
        f"world {_point([0.0] * len(far))} to {_point(far)}",
        f"region base = box {_point([0.2, 0.2, 0.2][: len(far)])} to {_point([BASE, BASE, 2.0][: len(far)])}",
        f"region goal = {_goal(generator)}",
        f"region spot = disc at {_point(generator.uniform(1.0, 5.0, 2))} radius {generator.uniform(0.4, 0.8):.2f}",
    ]
    lines += [f"obstacle still{number} = {_body(generator, volume)}" for number in range(generator.integers(0, 3))]
    lines += [
        f"obstacle mover{number} = {_mover(generator, volume, horizon)}" for number in range(generator.integers(0, 4))
    ]
    count = int(generator.integers(1, 5))
    lines += [_agents(generator, f"team drone[{count}]", step, volume)]
    several = count > 1 or bool(generator.random() < 0.3)
    if count == 1 and several:
        lines += [_agents(generator, "agent scout", step, volume)]
    lines += ["graph radio = proximity 2 m"] if several else []
    lines += [
        f"separation {_one(generator, [0.0, 0.1, 0.3]):g} m",
        f"clearance {_one(generator, [0.0, 0.0, 0.05, 0.2]):g} m",
        f"solve with smt {{ nodes = {int(generator.integers(40, 81))} }}",
    ]
    return "\n".join([*lines, *_requirements(generator, horizon, step, several)]) + "\n"


def _one(generator: np.random.Generator, values: list[float]) -> float:
    return values[int(generator.integers(len(values)))]


def _point(coordinates: np.ndarray | list[float] | tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in coordinates) + ")"


def _goal(generator: np.random.Generator) -> str:
    corner = generator.uniform(2.6, 4.2, 2)
    return f"box {_point(corner)} to {_point(corner + generator.uniform(0.8, 1.6, 2))}"


def _clear(generator: np.random.Generator, size: float) -> np.ndarray:
    """Position (2,) in metres at which a shape of this size does not reach the start."""
    while True:
        centre = generator.uniform(size, SIDE - size, 2)
        if centre.max() > BASE + size + 0.5:
            return centre


def _body(generator: np.random.Generator, volume: bool) -> str:
    """Shape clear of the start."""
    size = generator.uniform(0.2, 0.6)
    centre = _clear(generator, size)
    if volume and generator.random() < 0.3:
        return f"ball at {_point([*centre, generator.uniform(0.5, HEIGHT - 0.5)])} radius {size:.2f}"
    low, high = centre - size, centre + size
    band = f" height 0 m..{generator.uniform(1.0, HEIGHT):.2f} m" if volume else ""
    match int(generator.integers(4)):
        case 0:
            return f"box {_point(low)} to {_point(high)}{band}"
        case 1:
            return f"polygon {_point(low)}, {_point((high[0], low[1]))}, {_point(high)}{band}"
        case 2:
            post = f"box {_point(low)} to {_point((centre[0], high[1]))}{band}"
            return f"{post} + box {_point(centre - [size, 0.0])} to {_point(centre + np.array([size, size / 2]))}{band}"
        case _:
            return f"disc at {_point(centre)} radius {size:.2f}{band}"


def _mover(generator: np.random.Generator, volume: bool, horizon: float) -> str:
    """Motion over the start or the goal at some time, or to and fro."""
    size = generator.uniform(0.2, 0.6)
    climb = [0.0] if volume else []
    centre = _clear(generator, size)
    body = f"disc at {_point(centre)} radius {size:.2f}" if generator.random() < 0.7 else _body(generator, volume)
    if generator.random() < 0.7:
        target = generator.uniform(0.2, BASE, 2) if generator.random() < 0.6 else generator.uniform(2.0, 5.0, 2)
        speed = (target - centre) / (generator.uniform(0.2, 1.0) * horizon)
        return f"{body} moving {_point([*speed, *climb])} m/s"
    times = np.sort(generator.uniform(0.1, 1.0, 3)) * horizon
    knots = [f"({time:.3f} s: {_point([*generator.uniform(-2.0, 2.0, 2), *climb])[1:-1]})" for time in times]
    return f"{body} along (0 s: {_point([0.0, 0.0, *climb])[1:-1]}), " + ", ".join(knots)


def _agents(generator: np.random.Generator, head: str, step: float, volume: bool) -> str:
    fast = generator.uniform(0.6, 1.6) / step
    match int(generator.integers(5)):
        case 0:
            dynamics = f"double_integrator(speed <= {fast:.2f} m/s, acceleration <= {2 * fast / step:.2f} m/s^2)"
        case 1:
            dynamics = f"single_integrator(speed <= {fast:.2f} m/s)"
        case 2:
            dynamics = f"unicycle(speed {fast / 2:.2f}..{fast:.2f} m/s)"
        case 3:
            dynamics = f"unicycle(speed 0..{fast:.2f} m/s, turn <= {generator.uniform(60, 170) / step:.0f} deg/s)"
        case _:
            dynamics = f"unicycle(speed 0..{fast:.2f} m/s)"
    return f"{head} {{ radius {generator.uniform(0.05, 0.2):.2f} m  dynamics {dynamics}  start in base }}"


def _requirements(generator: np.random.Generator, horizon: float, step: float, several: bool) -> list[str]:
    possible = [
        f"every drone: eventually[0, {horizon:g} s] goal",
        f"drone[0]: eventually[0, {horizon - step:g} s] (goal and next goal)",
        f"every drone: ((not spot) until[0, {horizon:g} s] goal)",
        f"some drone: eventually[0, {horizon:g} s] (spot or goal)",
        f"every drone: (eventually[0, {horizon:g} s] goal and eventually[0, {horizon:g} s] spot)",
    ]
    if several:
        possible += [
            f"every drone: always[0, {horizon:g} s] (goal implies drone reach[hops 0..2 on radio] base)",
            f"always[0, {horizon:g} s] connected(radio)",
        ]
    chosen = generator.choice(len(possible), int(generator.integers(1, 3)), replace=False)
    return [f"require r{number}: {possible[number]}" for number in sorted(chosen.tolist())]
