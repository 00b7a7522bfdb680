"""Printer of the resolved mission (IR): one line for each item, formulas in words, and the parameters of vehicles.

    in   Mission
    out  text, the same for the same mission

Windows are in steps. Agents of declarations are numbered, and those in formulas have their names. A ``let`` is printed
by its name. Each parameter of a vehicle has its SI unit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import assert_never

from missionc import ir
from missionc.base.units import Metric
from missionc.frontend.resolve.resolve_quantities import SI


def show_formula(formula: ir.Formula, lets: dict[int, str], mission: ir.Mission) -> str:
    """Text of a formula, with brackets around every operand that is not a single word or call.

    Args:
        lets: name of a formula by its identity; such a formula is not expanded.
    """
    if id(formula) in lets:
        return lets[id(formula)]
    match formula:
        case ir.Truth(value, _):
            return "true" if value else "false"
        case ir.Holds(predicate, _):
            return predicate.show(Words(mission))
        case ir.Belongs(agents, _):
            return agents.name
        case ir.AtLeastOf(kind, count, agents, body, _):
            words = kind if kind != "at least" else f"at least {count}"
            return f"{words} {agents.name}: {show_formula(body, lets, mission)}"
        case ir.OfAgent(agent, body, _):
            return f"{mission.agents[agent].name}: {show_formula(body, lets, mission)}"
        case ir.Without(count, agents, body):
            return f"without any {count} {agents.name}: {show_formula(body, lets, mission)}"
        case ir.Apply():
            return _apply(formula, [_operand(operand, lets, mission) for operand in formula.operands])
        case _:
            assert_never(formula)


def _operand(formula: ir.Formula, lets: dict[int, str], mission: ir.Mission) -> str:
    text = show_formula(formula, lets, mission)
    bare = id(formula) in lets or isinstance(formula, ir.Truth | ir.Holds | ir.Belongs)
    return text if bare else f"({text})"


def _apply(formula: ir.Apply, operands: list[str]) -> str:
    word = f"{formula.operator.name}{_bounds(formula.bounds)}"
    if isinstance(formula.bounds, ir.Period):
        return f"{word}: {operands[0]}"
    if formula.operator.arity == 2:
        return f" {word} ".join(operands)
    compared = f" {formula.comparison} {formula.number}" if formula.comparison else ""
    return f"{word} {operands[0]}{compared}"


def _bounds(bounds: ir.Window | ir.Length | ir.Period | None) -> str:
    match bounds:
        case None:
            return ""
        case ir.Window(low, high, _):
            return f"[{low} steps, {'end' if high is None else f'{high} steps'}]"
        case ir.Period(steps):
            return f" {steps} steps"
        case ir.Length(graph, metric, low, high):
            unit = " m" if metric is Metric.METRES else ""
            upper = "" if high == math.inf else f"{number_text(high)}{unit}"
            return f"[{bounds.word} {number_text(low)}{unit}..{upper} on {graph.name}]"
        case _:
            assert_never(bounds)


class Words:
    """Printed forms of predicates."""

    def __init__(self, mission: ir.Mission) -> None:
        self.mission = mission

    def agent(self, index: int) -> str:
        return self.mission.agents[index].name

    def graph(self, graph: ir.Graph, agents: tuple[int, ...]) -> str:
        return graph.name if agents == graph.agents else ", ".join((graph.name, *map(self.agent, agents)))

    def angle(self, value: float) -> str:
        return f"{number_text(math.degrees(value))} deg"

    def inequality(self, terms: tuple[tuple[float, str], ...], constant: float, sign: str) -> str:
        signed = [
            (weight, word if abs(weight) == 1 else f"{number_text(abs(weight))}*{word}") for weight, word in terms
        ]
        if constant:
            signed.append((constant, number_text(abs(constant))))
        first, rest = signed[0], signed[1:]
        text = f"-{first[1]}" if first[0] < 0 else first[1]
        return text + "".join(f" {'-' if weight < 0 else '+'} {word}" for weight, word in rest) + f" {sign} 0"


def number_text(value: float) -> str:
    """Text of a number with twelve digits, without rounding noise: ``4.7``, ``20``."""
    return format(round(value, 12) + 0.0, ".12g")


def vector(values: Iterable[float]) -> str:
    return f"({', '.join(map(number_text, values))})"


def show_vehicle(vehicle: ir.Vehicle) -> str:
    """Text of a vehicle on one line, as a mission writes it; absent limits are omitted."""
    return "  ".join([vehicle.name, *(f"{name} {text}" for name, text in figures_of(vehicle) if text)])


def figures_of(vehicle: ir.Vehicle) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each vehicle parameter; the text is empty if there is no limit."""
    for name, figure in ir.FIGURES.items():
        value, unit = getattr(vehicle, name), SI[figure.dimension]
        match value:
            case ir.Band(low, high):
                yield name, "" if math.isinf(high) else f"{number_text(low)}..{number_text(high)}{unit}"
            case _:
                sign = f"{figure.relation} " if figure.relation else ""
                yield name, "" if value in (0, math.inf) else f"{sign}{number_text(value)}{unit}"


def show_yaw(yaw: ir.Yaw) -> str:
    """Text of a yaw setting; empty for the default along the x axis."""
    match yaw:
        case ir.AlongPath():
            return "along path"
        case ir.Fixed(angle):
            return "" if angle == 0 else f"{number_text(angle)} rad"


def show_ir(mission: ir.Mission) -> str:
    """Text of every declaration in the resolved mission, one on each line, in a fixed order."""
    return "\n".join(_lines(mission)) + "\n"


def _lines(mission: ir.Mission) -> Iterator[str]:
    yield f"mission {mission.name}"
    yield f"time step {number_text(mission.step)} s, {mission.steps} steps"
    yield f"world {vector(mission.world.low)} to {vector(mission.world.high)}"
    for region in mission.regions:
        yield f"region {region.name} = {show_shape(region.shape)}"
    for obstacle in mission.obstacles:
        grows = f" uncertain {number_text(obstacle.growth)} m/s" if obstacle.growth else ""
        yield f"obstacle {obstacle.name} = {show_shape(obstacle.shape)}{_motion(obstacle.motion)}{grows}"
    for beacon in mission.beacons:
        yield f"beacon {beacon.name} = {vector(beacon.position)}"
    for agent in mission.agents:
        yield _agent(agent, mission.dimension)
    for team, vehicle in dict.fromkeys((agent.team, agent.vehicle) for agent in mission.agents):
        if vehicle != ir.PLAIN:
            yield f"vehicle of {team} = {show_vehicle(vehicle)}"
    for agent in mission.agents:
        if agent.pad is not None:
            yield f"pad of {agent.name} = {_pad(agent.pad)}"
    for word, sets in (("team", mission.teams), ("group", mission.groups)):
        for agents in sets:
            yield f"{word} {agents.name} = {indices(agents.agents)}"
    for graph in mission.graphs:
        yield f"graph {graph.name} = {_graph(graph)} over {indices(graph.agents)}{''.join(map(_weight, graph.weights))}"
    for formation in mission.formations:
        yield from _formation(formation)
    for resource in mission.resources:
        yield _resource(resource)
    for flag in mission.flags:
        cleared = "" if flag.cleared_in is None else f", cleared in {flag.cleared_in.name}"
        yield f"flag {flag.name} of {indices(flag.agents)} set in {flag.set_in.name}{cleared}"
    yield f"separation {number_text(mission.separation)} m"
    yield f"clearance {number_text(mission.clearance)} m"
    for tolerance in mission.tolerances:
        yield f"tolerate delay {tolerance.steps} steps of {', '.join(map(str, tolerance.agents))}"
    yield from _formulas(mission)
    yield f"{mission.objective.word or 'minimize'} {mission.objective.value}"
    options = "".join(f" {name} = {number_text(value)}" for name, value in mission.solve.options)
    if mission.solve.connectivity is not ir.Connectivity.BOTTLENECK:
        options += f" connectivity = {mission.solve.connectivity.value}"
    lanes = mission.solve.roadmap
    if lanes is not None:
        options += f" roadmap = {lanes.path}, {len(lanes.nodes)} nodes, {len(lanes.lanes)} lanes"
    yield f"solve with {mission.solve.backend}{options}"


def _formulas(mission: ir.Mission) -> Iterator[str]:
    """Yield the lines of formulas; a ``let`` is expanded once, and referred to by its name."""
    lets: dict[int, str] = {}
    for name, formula in mission.lets:
        yield f"let {name} = {show_formula(formula, lets, mission)}"
        lets.setdefault(id(formula), name)
    for requirement in mission.requirements:
        yield f"require {requirement.name}: {show_formula(requirement.formula, lets, mission)}"
    for preference in mission.preferences:
        words = show_formula(preference.formula, lets, mission)
        yield f"prefer {preference.name}: {words} weight {number_text(preference.weight)}"


def show_shape(shape: ir.Shape) -> str:
    match shape:
        case ir.Box(low, high):
            return f"box {vector(low)} to {vector(high)}"
        case ir.Disc(centre, radius, band):
            return f"disc at {vector(centre)} radius {number_text(radius)}{_band(band)}"
        case ir.Ball(centre, radius):
            return f"ball at {vector(centre)} radius {number_text(radius)}"
        case ir.Polygon(corners, band):
            return f"polygon {', '.join(map(vector, corners))}{_band(band)}"
        case ir.Union(left, right):
            return f"({show_shape(left)} + {show_shape(right)})"
        case ir.Intersection(left, right):
            return f"({show_shape(left)} * {show_shape(right)})"
        case ir.Difference(left, right):
            return f"({show_shape(left)} - {show_shape(right)})"
        case _:
            assert_never(shape)


def _band(band: ir.Prism | None) -> str:
    return "" if band is None else f" height {number_text(band.low)}..{number_text(band.high)}"


def _motion(motion: ir.Still | ir.Path) -> str:
    match motion:
        case ir.Still():
            return ""
        case ir.Path(times, offsets):
            pairs = zip(times, offsets, strict=True)
            return " along " + ", ".join(f"{number_text(time)} s: {vector(offset)}" for time, offset in pairs)
        case _:
            assert_never(motion)


def _agent(agent: ir.Agent, dimension: int) -> str:
    parts = [f"radius {number_text(agent.radius)} m", _dynamics(agent.dynamics), f"start {_place(agent.start)}"]
    if agent.finish is not None:
        parts.append(f"finish {_place(agent.finish)}")
    if dimension == 2:
        parts.append(f"altitude {number_text(agent.altitude)} m")
    if show_yaw(agent.yaw):
        parts.append(f"yaw {show_yaw(agent.yaw)}")
    return f"agent {agent.index} {agent.name}: {', '.join(parts)}"


def _pad(pad: ir.Pad) -> str:
    """Text of a pad on one line: its position and its other settings."""
    where = "below its start" if pad.point is None else f"at {vector(pad.point)}"
    said = []
    for name, figure in ir.PAD_FIGURES.items():
        value = getattr(pad, name)
        if value is not None and not math.isinf(value):
            said.append(f"{name} {figure.relation} {number_text(value)}{SI[figure.dimension]}".replace("  ", " "))
    return "  ".join([where, *said])


def _dynamics(dynamics: ir.Dynamics) -> str:
    speed = f"{number_text(dynamics.lowest_speed)}.." if dynamics.may_be_restless else "<= "
    values = [(limit, getattr(dynamics, limit.setting)) for limit in dynamics.limits]
    limits = [
        f" {each.setting} <= {number_text(value)}{SI[each.dimension]}" for each, value in values if value < math.inf
    ]
    return f"{dynamics.word} speed {speed}{number_text(dynamics.top_speed)} m/s{''.join(limits)}"


def _place(place: ir.InitialSet) -> str:
    return f"in {place.region.name}" if place.region is not None else f"at {vector(place.point or ())}"


def _graph(graph: ir.Graph) -> str:
    match graph:
        case ir.Proximity():
            return f"proximity {number_text(graph.radius)} m{_pair_ranges(graph)}"
        case ir.Sight():
            return f"sight {number_text(graph.radius)} m{_pair_ranges(graph)}"
        case ir.BeaconCover():
            return f"beacons {', '.join(map(vector, graph.beacons))} within {number_text(graph.radius)} m"
        case _:
            assert_never(graph)


def _weight(weight: ir.Weight) -> str:
    pairs = (f", {indices(sorted(p.senders))} to {indices(sorted(p.receivers))} {p.weight}" for p in weight.pairs)
    return f" weight {weight.name} {weight.others}{''.join(pairs)}"


def _pair_ranges(graph: ir.Graph) -> str:
    return "".join(
        f", {indices(sorted(each.senders))} to {indices(sorted(each.receivers))} {number_text(each.radius)} m"
        for each in graph.ranges
    )


def _formation(formation: ir.Formation) -> Iterator[str]:
    total = "total " if formation.total else ""
    yield (
        f"formation {formation.name} = {formation.kind} of {indices(formation.agents)}"
        f" {total}tolerance {number_text(formation.tolerance)} m"
    )
    for edge in formation.edges:
        match edge.target:
            case tuple() as offset:
                yield f"  {edge.first} to {edge.second}: {vector(offset)}"
            case distance:
                yield f"  {edge.first} to {edge.second}: {number_text(distance)} m"


def _resource(resource: ir.Resource) -> str:
    parts = [f"start {number_text(resource.start)}", f"capacity {number_text(resource.capacity)}"]
    parts += [
        f"drain {number_text(drain)} per {unit}"
        for drain, unit in ((resource.per_second, "s"), (resource.per_metre, "m"))
        if drain
    ]
    parts += [f"refill {number_text(refill.per_second)} per s in {refill.region.name}" for refill in resource.refills]
    return f"resource {resource.name} of {indices(resource.agents)} {', '.join(parts)}"


def indices(agents: Sequence[int]) -> str:
    """Text of agent indices, consecutive ones as a range: ``0..4, 7``."""
    runs: list[list[int]] = []
    for agent in agents:
        if runs and agent == runs[-1][-1] + 1:
            runs[-1].append(agent)
        else:
            runs.append([agent])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}..{run[-1]}" for run in runs)
