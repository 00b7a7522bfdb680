"""Random missions of the whole language, small enough to be planned in seconds.

``random_flight_missions`` has missions that are hard to fly; these are hard to understand. Most are valid. Some are
impossible, which must be reported without a failure.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tests.support.random_formulas import Formulas, Names

SIDE, HEIGHT = 6.0, 3.0
"""Size of the world, metres."""

START = 2.2
"""Side of the start in metres, a square in the world's corner without obstacles at first."""


@dataclass
class _Drawn:
    """Declarations so far."""

    random: np.random.Generator
    volume: bool
    step: float
    steps: int
    clot: bool
    """True for bounds in metres and dynamics that ``clot`` plans."""
    lines: list[str] = field(default_factory=list)
    teams: list[tuple[str, int]] = field(default_factory=list)
    agents: list[str] = field(default_factory=list)

    def odds(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def one(self, *values: str) -> str:
        return values[int(self.random.integers(len(values)))]

    def point(self, *plane: float, height: float | None = None) -> str:
        """Point of the world: in a volume, with a given or random height."""
        if self.volume and len(plane) == 2:
            plane = (*plane, self.random.uniform(0.6, 1.8) if height is None else height)
        return "(" + ", ".join(f"{value:.2f}" for value in plane) + ")"

    def anywhere(self, margin: float = 0.8) -> tuple[float, float]:
        first, second = self.random.uniform(margin, SIDE - margin, 2)
        return float(first), float(second)

    def away(self) -> tuple[float, float]:
        """Random position outside the start."""
        while True:
            first, second = self.anywhere()
            if max(first, second) > START + 0.9:
                return first, second


def random_program(generator: np.random.Generator) -> dict[str, str]:
    """Files of a mission by name, ``m.mission`` first; the same generator gives the same texts."""
    draw = _Drawn(
        generator,
        volume=bool(generator.random() < 0.3),
        step=float(generator.choice([0.5, 1.0, 1.0])),
        steps=int(generator.integers(3, 8)),
        clot=bool(generator.random() < 0.4),
    )
    horizon = draw.step * draw.steps
    far = (SIDE, SIDE, HEIGHT) if draw.volume else (SIDE, SIDE)
    draw.lines += ["mission whole"]
    written = f"{horizon:g} s"
    if draw.odds(0.3):
        draw.lines += [f"param T = {horizon:g} s", "param R = (0.5 m + 30 cm)"]
        written = "T"
    draw.lines += [
        f"time step {draw.step:g} s, horizon {written}",
        f"world {draw.point(*[0.0] * len(far))} to {draw.point(*far)}",
    ]
    names = _places(draw)
    _teams(draw)
    faces = all("dynamics unicycle" in line for line in draw.lines if "dynamics" in line)
    names = replace(names, agents=tuple(draw.agents), teams=tuple(draw.teams), faces=faces)
    names = _couplings(draw, names)
    formulas = Formulas(generator, names)
    if draw.odds(0.3):
        draw.lines += [f"let calm = {formulas.agent(0, 1)}"]
        formulas.names = replace(names, lets=("calm",))
    _wishes(draw, formulas)
    return _files(draw)


def _files(draw: _Drawn) -> dict[str, str]:
    """Files of the mission, sometimes with declarations in a file of their own."""
    if draw.odds(0.15):
        places = [line for line in draw.lines if line.startswith(("region", "beacon"))]
        rest = [line for line in draw.lines if line not in places]
        return {
            "m.mission": "\n".join([rest[0], 'include "places.mission"', *rest[1:]]) + "\n",
            "places.mission": "\n".join(places) + "\n",
        }
    return {"m.mission": "\n".join(draw.lines) + "\n"}


# ------------------------------------------------------------------- places


def _places(draw: _Drawn) -> Names:
    corner = (START, START, 2.0) if draw.volume else (START, START)
    regions = ["base", "goal"]
    draw.lines += [
        f"region base = box {draw.point(*[0.3] * len(corner))} to {draw.point(*corner)}",
        f"region goal = {_shape(draw, draw.away(), 0.9)}",
    ]
    if draw.odds(0.6):
        draw.lines += [f"region spot = {_shape(draw, draw.anywhere(), 0.7)}"]
        regions += ["spot"]
    if draw.odds(0.4):
        sign = draw.one("+", "-", "*")
        draw.lines += [
            f"region part = {draw.one('goal', '(goal + base)')} {sign} {_shape(draw, draw.anywhere(1.5), 1.4)}"
        ]
        regions += ["part"]
    if draw.odds(0.3):
        x, y = draw.away()
        draw.lines += [
            f"region bay[i in 0..1] = disc at ({x:.2f} - i*0.5, {y:.2f}) radius max(0.3, 0.6 - i / 10)",
        ]
        regions += ["bay[0]", "bay[1]"]
    for number in range(int(draw.random.integers(0, 3))):
        moving = _motion(draw) if draw.odds(0.4) else ""
        moving += " uncertain 0.05 m/s" if draw.odds(0.2) else ""
        draw.lines += [f"obstacle block{number} = {_shape(draw, draw.away(), 0.4)}{moving}"]
    beacons = [f"mast{number}" for number in range(int(draw.random.integers(0, 3)))]
    draw.lines += [f"beacon {name} = {draw.point(*draw.anywhere())}" for name in beacons]
    return Names(draw.step, regions, beacons, (), (), (), (), not draw.clot, draw.clot or draw.odds(0.05), draw.volume)


def _shape(draw: _Drawn, centre: tuple[float, float], size: float, combined: bool = True) -> str:
    x, y = centre
    band = (
        f" height {draw.one('0 m', '0.3 m')}..{draw.random.uniform(1.5, HEIGHT):.2f} m"
        if draw.volume and draw.odds(0.5)
        else ""
    )
    size *= draw.random.uniform(0.7, 1.3)
    kinds = ["box", "disc", "polygon"]
    kinds += ["ball", "cylinder", "cuboid"] if draw.volume else []
    kinds += ["sum", "less"] if combined else []

    def flat(*points: tuple[float, float]) -> list[str]:
        return [f"({a:.2f}, {b:.2f})" for a, b in points]

    match draw.one(*kinds):
        case "box":
            low, high = flat((x - size, y - size), (x + size, y + size))
            return f"box {low} to {high}{band}"
        case "cuboid":
            return f"box {draw.point(x - size, y - size, 0.2)} to {draw.point(x + size, y + size, 1.9)}"
        case "polygon":
            corners = flat(
                (x - size, y - size), (x + size, y - size * 0.6), (x + size * 0.4, y + size), (x - size * 0.5, y + size)
            )
            return f"polygon {', '.join(corners[: int(draw.random.integers(3, 5))])}{band}"
        case "sum":
            return (
                f"({_shape(draw, centre, size * 0.7, False)} + {_shape(draw, (x + size * 0.4, y), size * 0.5, False)})"
            )
        case "less":
            return f"({_shape(draw, centre, size, False)} - {_shape(draw, (x + size, y + size), size * 0.4, False)})"
        case "ball":
            return f"ball at ({x:.2f}, {y:.2f}, {draw.random.uniform(0.8, 1.6):.2f}) radius {size:.2f} m"
        case "cylinder":
            return (
                f"cylinder at ({x:.2f}, {y:.2f}) radius {size:.2f} height 0.2 m..{draw.random.uniform(1.5, 2.8):.2f} m"
            )
        case _:
            (middle,) = flat(centre)
            return f"disc at {middle} radius {size:.2f} m{band}"


def _motion(draw: _Drawn) -> str:
    climb = [0.0] if draw.volume else []
    if draw.odds(0.5):
        return f" moving {draw.point(*draw.random.uniform(-0.4, 0.4, 2), *climb)} m/s"
    end = draw.step * draw.steps
    knots = [(0.0, (0.0, 0.0)), (end / 2, draw.random.uniform(-1, 1, 2)), (end, draw.random.uniform(-1, 1, 2))]
    return " along " + ", ".join(f"({time:g} s: {draw.point(*place, *climb)[1:-1]})" for time, place in knots)


# -------------------------------------------------------------------- agents


def _teams(draw: _Drawn) -> None:
    count = int(draw.random.integers(1, 5))
    draw.lines += [f"team drone[{count}] {{ {_items(draw, count, 0)} }}"]
    draw.teams += [("drone", count)]
    draw.agents += [f"drone[{number}]" for number in range(count)]
    if draw.odds(0.35):
        draw.lines += [f"agent scout {{ {_items(draw, 1, 1)} }}"]
        draw.agents += ["scout"]
        if draw.odds(0.7):
            draw.lines += ["group all_ = drone, scout"]
            draw.teams += [("all_", count + 1)]
    if count > 2 and draw.odds(0.3):
        draw.lines += ["group few = drone[0..1]"]
        draw.teams += [("few", 2)]


def _items(draw: _Drawn, count: int, row: int) -> str:
    items = [f"radius {draw.random.uniform(0.05, 0.15):.2f} m"] if draw.odds(0.8) else []
    items += [
        f"dynamics {_dynamics(draw)}",
        f"start {_place(draw, count, (0.6, 0.6 + 1.1 * row), 'base', 'in' if row else '')}",
    ]
    if draw.odds(0.2):
        far = draw.away()
        items += [f"finish {_place(draw, count, (min(far[0], SIDE - 2), far[1]), 'goal', '')}"]
    if draw.odds(0.2) and not draw.volume:
        items += [f"altitude {draw.random.uniform(0.5, 1.5):.1f} m"]
    if draw.odds(0.25):
        vehicle = draw.one(
            "crazyflie21", "brushless21", "plain { tracking 2 cm }", "plain { speed <= 3 m/s  pair_distance 0.3 m }"
        )
        items += [f"vehicle {vehicle}"]
    if draw.odds(0.15):
        items += [draw.one("flight", "flight { rise <= 0.3 m/s  land <= 0.2 m/s }")]
    if draw.odds(0.2):
        items += [draw.one("yaw 90 deg", "yaw along path")]
    return "  ".join(items)


def _dynamics(draw: _Drawn) -> str:
    fast = draw.random.uniform(0.8, 1.8) / draw.step
    kinds = ["single", "double"] + ([] if draw.clot else ["unicycle", "turning"])
    match draw.one(*kinds):
        case "single":
            return f"single_integrator(speed <= {fast:.2f} m/s)"
        case "double":
            return f"double_integrator(speed <= {fast:.2f} m/s, acceleration <= {2 * fast / draw.step:.2f} m/s^2)"
        case "unicycle":
            return f"unicycle(speed {draw.one('0', f'{fast / 3:.2f}')}..{fast:.2f} m/s)"
        case _:
            return f"unicycle(speed 0..{fast:.2f} m/s, turn <= 120 deg/s)"


def _place(draw: _Drawn, count: int, corner: tuple[float, float], region: str, only: str) -> str:
    x, y = corner
    match only or draw.one("in", "at", "line", "grid"):
        case "at":
            places = [
                draw.point(x + 0.55 * number, y + draw.random.uniform(0, 0.4), height=1.0) for number in range(count)
            ]
            return f"at {', '.join(places)}"
        case "line":
            return f"line {draw.point(x, y, height=1.0)} to {draw.point(x + 1.6, y + 0.5, height=1.0)}"
        case "grid":
            return f"grid {draw.point(x, y, height=1.0)} to {draw.point(x + 1.4, y + 1.2, height=1.0)}"
        case _:
            return f"in {region}"


def _ranges(draw: _Drawn) -> str:
    """Ranges of a pair of teams in one direction, or among the members of one.

    Later random values do not depend on it.
    """
    own = np.random.default_rng(len("".join(draw.lines)))
    sizes = dict(draw.teams)
    pairs = [(one, other) for one in sizes for other in sizes if one != other or sizes[one] > 1]
    if not pairs or own.random() < 0.6:
        return ""
    one, other = pairs[int(own.integers(len(pairs)))]
    weight = own.choice(["", f" weight cost {own.integers(1, 4)}"])
    return f" {{ {one} to {other} {own.uniform(0.9, 4):.2f} m }}{weight}"


def _couplings(draw: _Drawn, names: Names) -> Names:
    """Graphs, formations and distances between agents."""
    graphs, formations = [], []
    count = dict(draw.teams)["drone"]
    if len(draw.agents) > 1 and draw.odds(0.8):
        draw.lines += [f"graph radio = proximity {draw.random.uniform(0.9, 3):.2f} m{_ranges(draw)}"]
        graphs += ["radio"]
    if names.beacons and count > 1 and draw.odds(0.6):
        draw.lines += [f"graph cell = beacons {draw.random.uniform(1.5, 4):.2f} m" + draw.one("", " over drone")]
        graphs += ["cell"]
    if (
        len(draw.agents) > 1
        and draw.odds(0.3)
        and not any(" moving " in each or " along (" in each for each in draw.lines)
    ):
        draw.lines += [f"graph eyes = sight {draw.random.uniform(1.5, 4):.2f} m"]
        graphs += ["eyes"]
    if count > 1 and draw.odds(0.5):
        draw.lines += [f"formation shape = {_formation(draw, count)}"]
        formations += ["shape"]
    if draw.odds(0.4):
        draw.lines += [f"separation {draw.one('0', '0.1', '5 c', '0.2 ')}m"]
    if draw.odds(0.3):
        draw.lines += [f"clearance {draw.one('0', '0.05', '10 c')}m"]
    names = replace(names, graphs=tuple(graphs), formations=tuple(formations))
    return names if draw.clot else _own_state(draw, names)


def _own_state(draw: _Drawn, names: Names) -> Names:
    """Resource of all agents, and flag of one team."""
    resources, flags = [], []
    if draw.odds(0.3):
        draw.lines += [f"group everybody = {', '.join(draw.agents)}"]
        drains = draw.one("drain 1 per s", "drain 0.5 per m", "drain 30 per min, drain 0.3 per m")
        refill = f"refill {draw.one('2', '4.5')} per s in {draw.one(*names.regions)}"
        draw.lines += [f"resource battery of everybody {{ start {draw.one('20', '30')}, {drains}, {refill} }}"]
        resources += ["battery"]
    if draw.odds(0.4):
        cleared = f", cleared in {draw.one(*names.regions)}" if draw.odds(0.6) else ""
        draw.lines += [f"flag seen of drone {{ set in {draw.one(*names.regions)}{cleared} }}"]
        flags += ["seen"]
    return replace(names, resources=tuple(resources), flags=tuple(flags))


def _formation(draw: _Drawn, count: int) -> str:
    apart = draw.random.uniform(0.6, 1.0)
    tolerance = f"{draw.one('', '', 'total ') if draw.clot else ''}tolerance {draw.random.uniform(0.2, 0.6):.2f} m"
    match draw.one("line", "heading", "chain", "circle", "radius", "grid", "rows", "star", "offsets", "distances"):
        case "heading":
            return f"line of drone spacing {apart:.2f} m heading 30 deg {tolerance}"
        case "radius":
            return f"circle of drone radius {apart:.2f} m {tolerance}"
        case "rows":
            return f"grid of drone spacing {apart:.2f} m rows {draw.one('1', '2')} {tolerance}"
        case "offsets":
            places = [draw.point(apart * number, 0.2 * number, height=0.0) for number in range(count)]
            return f"offsets of drone {', '.join(places)} {tolerance}"
        case "distances":
            pairs = [f"{number}-{number + 1}: {apart:.2f} m" for number in range(count - 1)]
            return f"distances of drone ({', '.join(pairs)}) {tolerance}"
        case form:
            return f"{form} of drone spacing {apart:.2f} m {tolerance}"


# -------------------------------------------------------------------- wishes


def _wishes(draw: _Drawn, formulas: Formulas) -> None:
    for number in range(int(draw.random.integers(1, 4))):
        depth = int(draw.random.integers(1, 4))
        formula = formulas.quantified(draw.steps, depth) if draw.odds(0.6) else formulas.team(draw.steps, depth)
        if draw.odds(0.3):
            formula = f"eventually[0, {draw.step * draw.steps:g} s] ({formulas.team(0, 2)})"
        draw.lines += [f"require r{number}: {_beside_constant(draw, formulas, formula)}"]
    if draw.odds(0.25):
        draw.lines += [f"require tour{number}: {_tour(draw, formulas)}" for number in range(2)]
    if any("bay[i in" in line for line in draw.lines):
        end = f"{draw.step * draw.steps:g} s"
        draw.lines += [
            f"require bays: for some i in 0..1: eventually[0, {end}] some drone: bay[i]",
            f"prefer each[k in 0..1]: eventually[0, {end}] some drone: bay[k]",
        ]
    if draw.odds(0.4):
        wish = _beside_constant(draw, formulas, formulas.team(draw.steps, 2))
        draw.lines += [f"prefer {wish}" + draw.one("", " weight 2")]
    if draw.odds(0.6):
        draw.lines += [f"minimize {draw.one('distance', 'duration', *(['energy'] if draw.clot else []))}"]
    backend = draw.one("auto", "auto", "auto", "clot" if draw.clot else "smt", "hybrid")
    draw.lines += [f"solve with {backend}" + (" { nodes = 40 }" if backend in ("smt", "hybrid") else "")]


def _beside_constant(draw: _Drawn, formulas: Formulas, formula: str) -> str:
    """Formula, or sometimes an equivalent or a constant one."""
    if not draw.odds(0.2):
        return formula
    before = f"[{draw.step:g} s, {2 * draw.step:g} s] ({formulas.team(0, 1)})"  # none of its steps is in the mission
    everybody = f"(every {draw.teams[0][0]}: {draw.teams[0][0]})"
    value = draw.one("true", "false", f"once{before}", f"historically{before}", everybody, f"not {everybody}")
    return f"({formula}) {draw.one('or', 'or', 'and', 'implies')} ({value})"


def _tour(draw: _Drawn, formulas: Formulas) -> str:
    """Two places in sequence, with windows that end at or before the mission's end."""
    first = int(draw.random.integers(1, draw.steps + 1))
    second = int(draw.random.integers(0, draw.steps - first + 1)) if draw.odds(0.5) else draw.steps - first
    places = formulas.names.regions
    then = f"eventually[0, {second * draw.step:g} s] {draw.one(*places)}"
    return f"{draw.one(*draw.agents)}: eventually[0, {first * draw.step:g} s] ({draw.one(*places)} and {then})"
