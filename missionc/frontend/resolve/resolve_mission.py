"""Resolution of a mission: looks up names and parameters, converts units to steps and metres, types formulas.

    in   Program, Limits, the values of parameters given on the command line
    out  Mission, or None if there are errors
    says MC005 MC006 MC013 MC014 MC1xx MC2xx MC302–MC306 MC512 MC513

All declarations are resolved in one fixed order, each part on the ones before it; names may occur in any order in the
text. All findings are reported together, in the order of the text. A resolved mission can be trusted: its numbers are
finite (except for those that may be infinite: a unicycle's ``turn``, a route's upper bound and absent limits of a
vehicle) and in the units the IR names, its indices exist, its windows are not reversed, every point has the world's
coordinates, and every requirement is about the team.
"""

from __future__ import annotations

from typing import TypeVar

from missionc import ir
from missionc.base.diagnostics.model import Diagnostic, has_errors, in_text_order
from missionc.base.limits import Limits
from missionc.base.source import Span
from missionc.base.units import Dimension, Metres, Seconds, Steps
from missionc.frontend.resolve.context import Context, collect, unused
from missionc.frontend.resolve.resolve_agents import resolve_groups, resolve_set, resolve_teams
from missionc.frontend.resolve.resolve_files import with_places
from missionc.frontend.resolve.resolve_formations import resolve_formation
from missionc.frontend.resolve.resolve_formulas import resolve_lets
from missionc.frontend.resolve.resolve_goals import resolve_objective, resolve_requirements, resolve_solve
from missionc.frontend.resolve.resolve_graphs import resolve_flag, resolve_graph, resolve_resource
from missionc.frontend.resolve.resolve_quantities import resolve_parameters, resolved_number
from missionc.frontend.resolve.resolve_settings import missing, only
from missionc.frontend.resolve.resolve_shapes import resolve_point, resolve_regions, resolve_world
from missionc.frontend.resolve.resolve_time import resolve_delay, resolve_time
from missionc.frontend.resolve.spell_out import spell_out
from missionc.frontend.syntax import ast


def resolve(
    program: ast.Program,
    overrides: dict[str, str],
    limits: Limits,
    stretch: float = 1.0,
    vehicle: ir.Vehicle = ir.PLAIN,
) -> tuple[ir.Mission | None, list[Diagnostic]]:
    """The resolved mission, None if there are errors, and all findings about it.

    Args:
        overrides: values of parameters from the command line.
        stretch: factor of the mission's duration.
        vehicle: vehicle of teams that declare none.
    """
    program, findings, files = with_places(program, overrides, limits)
    names = collect(program, findings)
    spelt_out = spell_out(program, names, overrides, limits, findings)
    if spelt_out is None:
        return None, in_text_order(findings)
    written, program = program, spelt_out
    context = Context(names if spelt_out is written else collect(program, []), limits, findings, vehicle=vehicle)
    resolve_parameters(context, overrides)
    name = _needed(context, program, ast.MissionName, "the mission's name", "start with `mission NAME`")
    time = _needed(context, program, ast.Time, "the time", "add `time step 1 s, horizon 20 s`")
    world = _needed(context, program, ast.World, "the world", "add `world (0, 0) to (10, 10)`")
    if time is not None:
        resolve_time(context, time, stretch)
    if world is not None:
        resolve_world(context, world)
    _resolve_things(context, program)
    resolve_lets(context)
    requirements, preferences = resolve_requirements(context, program)
    minimize = only(context, program.declarations, ast.Minimize, whole=True)
    objective = resolve_objective(context, minimize)
    solve = resolve_solve(context, only(context, program.declarations, ast.Solve, whole=True))
    separation = only(context, program.declarations, ast.Separation, whole=True)
    clearance = only(context, program.declarations, ast.Clearance, whole=True)
    margins = [
        Metres(0.0 if item is None else resolved_number(context, item.distance, Dimension.LENGTH, what, least=0))
        for item, what in ((separation, "the separation"), (clearance, "the clearance"))
    ]
    tolerances = tuple(
        ir.Tolerance(resolve_set(context, item.agents).agents, resolve_delay(context, item.delay), item.span)
        for item in program.declarations
        if isinstance(item, ast.Tolerate)
    )
    names.suggested.update(text.partition("[")[0] for text in context.names.suggested)
    findings.extend(unused(names, written))
    sorted_findings = in_text_order(findings)
    if has_errors(findings) or name is None or time is None or world is None:
        return None, sorted_findings
    mission = ir.Mission(
        name=name.name.text,
        step=Seconds(context.step),
        steps=Steps(context.steps),
        world=ir.World(context.low, context.high, world.span),
        regions=tuple(context.regions.values()),
        obstacles=tuple(context.obstacles.values()),
        beacons=tuple(context.beacons.values()),
        agents=tuple(context.agents),
        teams=tuple(context.sets[team.name.text] for team in context.declared(ast.Team)),
        groups=tuple(context.sets[group.name.text] for group in context.declared(ast.Group)),
        graphs=tuple(context.graphs.values()),
        formations=tuple(context.formations.values()),
        separation=margins[0],
        clearance=margins[1],
        requirements=requirements,
        preferences=preferences,
        objective=objective,
        solve=solve,
        span=name.span,
        objective_span=None if minimize is None else minimize.span,
        time_span=time.span,
        tolerances=tolerances,
        files=tuple(files),
        lets=tuple((text, let.formula) for text, let in context.lets.items()),
        resources=tuple(context.resources.values()),
        flags=tuple(context.flags.values()),
    )
    return mission, sorted_findings


def _resolve_things(context: Context, program: ast.Program) -> None:
    """Resolve regions, obstacles, beacons, agents, groups, graphs, formations, resources, flags."""
    resolve_regions(context)
    for beacon in context.declared(ast.Beacon):
        place = resolve_point(context, beacon.position)
        context.beacons[beacon.name.text] = ir.Beacon(beacon.name.text, place, beacon.name.span)
    if not any(isinstance(item, ast.Team) for item in program.declarations):
        missing(context, "a team or an agent", _start(program), "add, for example, `team drone[5] { … }`")
    resolve_teams(context)
    resolve_groups(context)
    for graph in context.declared(ast.Graph):
        context.graphs[graph.name.text] = resolve_graph(context, graph)
    for formation in context.declared(ast.Formation):
        context.formations[formation.name.text] = resolve_formation(context, formation)
    for resource in context.declared(ast.Resource):
        context.resources[resource.name.text] = resolve_resource(context, resource)
    for flag in context.declared(ast.Flag):
        context.flags[flag.name.text] = resolve_flag(context, flag)


Item = TypeVar("Item", bound=ast.Node)


def _needed(context: Context, program: ast.Program, kind: type[Item], what: str, way_out: str) -> Item | None:
    """The single declaration of a kind; if it is missing or repeated, that is reported."""
    found = only(context, program.declarations, kind, whole=True)
    if found is None:
        missing(context, what, _start(program), way_out)
    return found


def _start(program: ast.Program) -> Span:
    """Source span for findings about missing declarations: the first declaration."""
    return program.declarations[0].span if program.declarations else program.span
