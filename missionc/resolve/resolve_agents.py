"""Resolution of teams and agents, numbered through the mission, with their starts and finishes; groups of them.

says MC013 MC014 MC105 MC206 MC207 MC209 MC210 MC303 MC513
"""

from __future__ import annotations

import math
from typing import TypeVar, assert_never

from missionc import ir
from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.base.units import Dimension, Metres
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix, Label
from missionc.resolve.context import Context
from missionc.resolve.definitions import ordered
from missionc.resolve.grid import on_grid, on_line
from missionc.resolve.names import AGENTS, Kind, Unresolved
from missionc.resolve.resolve_dynamics import UNMOVED, resolve_dynamics
from missionc.resolve.resolve_pads import pads_of, resolve_pads
from missionc.resolve.resolve_points import known, resolve_point
from missionc.resolve.resolve_quantities import excerpt, number, shown, whole
from missionc.resolve.resolve_settings import known_settings, missing, relation, said_twice
from missionc.resolve.resolve_shapes import NOWHERE
from missionc.resolve.resolve_vehicles import resolve_vehicle, resolve_yaw
from missionc.syntax import ast

ALTITUDE = Metres(1.0)
"""What an agent has where its team does not say."""


@dataclass(frozen=True, slots=True)
class NoFinish:
    """The mission does not say where its agents end."""


NO_FINISH = NoFinish()


# --------------------------------------------------------------------- teams


def resolve_teams(context: Context) -> None:
    """Every team's agents; none at all where they would be more than the limit."""
    teams = context.declared(ast.Team)
    for team in teams:
        name = team.name.text
        what = f"the size of `{name}`"
        context.sizes[name] = 1.0 if team.size is None else whole(context, team.size, what, least=1)
    too_many = _over_the_limit(context, teams)
    for team in teams:
        size = context.sizes[team.name.text]
        _team(context, team, size if not too_many else math.nan)
    context.everyone = tuple(range(len(context.agents)))


def _over_the_limit(context: Context, teams: list[ast.Team]) -> bool:
    """Whether there are too many agents; said at the team that makes them so, before any is made."""
    total = 0.0
    for team in teams:
        size = context.sizes[team.name.text]
        total += 0 if math.isnan(size) else size
        if total > context.limits.agents:
            context.report(
                code.TOO_MANY_AGENTS,
                f"the mission has {shown(total)} agents; the limit is {context.limits.agents}",
                (team.size or team.name).span,
                help="make the team smaller, or raise the limit with `--limit agents=VALUE`",
            )
            return True
    return False


def _team(context: Context, team: ast.Team, size: float) -> None:
    """Adds the agents of one team; with a size of NaN its items are looked at and none is added."""
    name = team.name.text
    owner = f"`{name}`"
    settings = known_settings(
        context, [item for item in team.items if isinstance(item, ast.Setting)], _settings(context), owner
    )
    flown = _only(context, team, ast.Vehicle, "vehicle")
    vehicle = resolve_vehicle(context, flown[0]) if flown else context.vehicle
    turns = _only(context, team, ast.Yaw, "yaw")
    yaw = resolve_yaw(context, turns[0]) if turns else ir.AHEAD
    radius = _length(context, settings.get("radius"), Metres(vehicle.radius), f"the radius of {owner}")
    altitude = _length(context, settings.get("altitude"), ALTITUDE, f"the altitude of {owner}")
    moves = _only(context, team, ast.Dynamics, "dynamics")
    starts = _only(context, team, ast.Start, "start")
    ends = _only(context, team, ast.Finish, "finish")
    dynamics: ir.Dynamics = UNMOVED
    if moves:
        dynamics = resolve_dynamics(context, moves[0])
    else:
        missing(
            context,
            f"how {owner} moves",
            team.name.span,
            "say it in the braces, as in `dynamics single_integrator(speed <= 1 m/s)`",
        )
    start: tuple[ir.Place, ...] = ()
    if starts:
        start = _places(context, starts[0].places, size, owner)
    else:
        missing(context, f"where {owner} starts", team.name.span, "say it in the braces: `start in REGION`")
    finish = _places(context, ends[0].places, size, owner) if ends else NO_FINISH
    first = len(context.agents)
    count = 0 if math.isnan(size) else int(size)
    pads = _pads(context, team, size, owner)
    for index in range(count if len(start) == count else 0):
        agent = ir.Agent(
            index=first + index,
            name=name if team.size is None else f"{name}[{index}]",
            team=name,
            radius=radius,
            dynamics=dynamics,
            start=start[index],
            finish=None if isinstance(finish, NoFinish) or len(finish) != count else finish[index],
            altitude=altitude,
            span=team.name.span,
            vehicle=vehicle,
            yaw=yaw,
            pad=pads[index] if len(pads) == count else None,
        )
        context.agents.append(agent)
    members = tuple(range(first, len(context.agents)))
    context.sets[name] = ir.AgentSet(name, members, team.name.span)


def _pads(context: Context, team: ast.Team, size: float, owner: str) -> tuple[ir.Pad, ...]:
    """One for each agent; none where the team does not say how it comes from the floor."""
    flights = _only(context, team, ast.Flight, "flight")
    if not flights:
        return ()
    said = pads_of(context, flights[0])
    places = _places(context, said.places, size, owner) if said is not None else None
    return resolve_pads(context, flights[0], places, owner, 0 if math.isnan(size) else int(size))


def _settings(context: Context) -> tuple[str, ...]:
    """In a volume the height of an agent is its third coordinate."""
    return ("radius",) if context.dimension == 3 else ("radius", "altitude")


def _length(context: Context, setting: ast.Setting | None, default: Metres, what: str) -> Metres:
    if setting is None:
        return default
    relation(context, setting, "", "=")
    return Metres(number(context, setting.high, Dimension.LENGTH, what, least=0))


Item = TypeVar("Item", ast.Dynamics, ast.Start, ast.Finish, ast.Vehicle, ast.Flight, ast.Yaw)


def _only(context: Context, team: ast.Team, kind: type[Item], word: str) -> list[Item]:
    """The items of a kind; a second one is reported."""
    items = [item for item in team.items if isinstance(item, kind)]
    for again in items[1:]:
        said_twice(context, f"`{word}`", again.span, items[0].span)
    return items


# --------------------------------------------------------------------- places


def _places(context: Context, places: ast.Places, size: float, owner: str) -> tuple[ir.Place, ...]:
    """One place for each agent, in index order; none where the size is NaN."""
    count = 0 if math.isnan(size) else int(size)
    match places:
        case ast.InRegion(region=name):
            declared = context.find(name, Kind.REGION)
            region = context.regions.get(name.text, ir.Region(name.text, NOWHERE, name.span))
            return () if isinstance(declared, Unresolved) else (ir.Anywhere(region, places.span),) * count
        case ast.AtPoints(points=points):
            here = tuple(ir.Exactly(resolve_point(context, point), point.span) for point in points)
            if len(here) != size and not math.isnan(size):
                _not_one_each(context, places, owner, count)
                return ()
            return here
        case ast.OnLine(first=first, last=last):
            ends = resolve_point(context, first), resolve_point(context, last)
            return _exactly(on_line(*ends, count), places.span) if count and _sound(ends) else ()
        case ast.OnGrid(low=low, high=high):
            ends = resolve_point(context, low), resolve_point(context, high)
            return _exactly(on_grid(*ends, count), places.span) if count and _sound(ends) else ()
        case ast.AtListed():  # what the file holds took its place, or is reported
            return ()
        case _:
            assert_never(places)


def _exactly(points: tuple[ir.Vector, ...], span: Span) -> tuple[ir.Place, ...]:
    return tuple(ir.Exactly(point, span) for point in points)


def _sound(ends: tuple[ir.Vector, ir.Vector]) -> bool:
    return len(ends[0]) == len(ends[1]) and known(*ends)


def _not_one_each(context: Context, places: ast.AtPoints, owner: str, agents: int) -> None:
    context.report(
        code.VALUE_OUT_OF_RANGE,
        f"{owner} has {agents} {'agent' if agents == 1 else 'agents'} and {len(places.points)} places",
        places.span,
        help="give one place for each agent, or use `in`, `line` or `grid`",
    )


# ------------------------------------------------------------ sets of agents


def resolve_groups(context: Context) -> None:
    """Every group's agents, in the order named; an agent named twice counts once, at its first place."""
    groups = {group.name.text: group for group in context.declared(ast.Group)}
    for name in ordered(context, {name: group.members for name, group in groups.items()}):
        group = groups[name]
        named: dict[int, None] = {}
        for member in group.members:
            agents = resolve_set(context, member).agents
            if not _room(context, len(agents), member.span):
                break
            named.update(dict.fromkeys(agents))
        context.sets[name] = ir.AgentSet(name, tuple(named), group.name.span)


def resolve_set(context: Context, reference: ast.Name | ast.Member) -> ir.AgentSet:
    """The agents a name or a member stands for; none where it is reported."""
    nobody = ir.AgentSet(excerpt(reference.span), (), reference.span)
    match reference:
        case ast.Name(text=text):
            declared = context.find(reference, *AGENTS, needed="a team, a group or an agent")
            return nobody if isinstance(declared, Unresolved) else context.sets.get(text, nobody)
        case ast.Member(team=team):
            declared = context.find(team, Kind.TEAM)
            if isinstance(declared, Unresolved):
                return nobody
            return _members(context, reference, nobody)
        case _:
            assert_never(reference)


def _members(context: Context, member: ast.Member, nobody: ir.AgentSet) -> ir.AgentSet:
    """The agents of a team from one index to another."""
    team = member.team.text
    size = context.sizes.get(team, math.nan)
    match member.low:
        case ast.Arithmetic(span, "-", ast.Number(unit=None) as first, ast.Number(unit=None) as last):
            context.report(
                code.NO_SUCH_MEMBER,
                f"`{excerpt(span)}` is a difference; members of a team are counted with two points",
                span,
                help=f"write `{team}[{shown(first.value)}..{shown(last.value)}]`",
                fix=Fix(span, f"{shown(first.value)}..{shown(last.value)}"),
            )
            return nobody
        case _:
            low = whole(context, member.low, "the index")
    high = low if member.high is None else whole(context, member.high, "the index")
    if low > high:
        context.report(
            code.BOUNDS_REVERSED,
            f"bounds run backwards: {shown(high)} comes after {shown(low)}",
            member.span,
            help=f"write `{team}[{shown(high)}..{shown(low)}]`",
            fix=Fix(member.span, f"{team}[{shown(high)}..{shown(low)}]"),
        )
        return nobody
    agents = context.sets[team].agents
    if math.isnan(low) or math.isnan(high):
        return nobody
    if high >= size:
        _no_such_member(context, member, int(high), int(size))
        return nobody
    if len(agents) != size:
        return nobody
    if not _room(context, int(high - low) + 1, member.span):
        return nobody
    name = f"{team}[{shown(low)}]" if member.high is None else f"{team}[{shown(low)}..{shown(high)}]"
    return ir.AgentSet(name, agents[int(low) : int(high) + 1], member.span)


def _room(context: Context, count: int, span: Span) -> bool:
    """Whether groups and ranges, spelt out, still have room for so many agents; said once where they have not."""
    limit = context.limits.formula_nodes
    before = context.members
    context.members += count
    if before <= limit < context.members:
        context.report(
            code.TOO_LARGE_TO_EXPAND,
            f"groups and ranges name {context.members} agents up to here, spelt out; the limit is {limit}",
            span,
            help="name whole teams, or raise the limit with `--limit formula_nodes=VALUE`",
        )
    return context.members <= limit


def _no_such_member(context: Context, member: ast.Member, index: int, size: int) -> None:
    team = member.team.text
    last = f"{team}[0]" if size == 1 else f"{team}[0]` … `{team}[{size - 1}]"
    context.report(
        code.NO_SUCH_MEMBER,
        f"`{team}[{index}]` is not there: `{team}` has {size} {'agent' if size == 1 else 'agents'}",
        member.span,
        labels=(Label(context.names.declared[team].span, "declared here"),),
        help=f"name `{last}`",
    )
