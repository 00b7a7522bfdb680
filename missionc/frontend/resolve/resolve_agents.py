"""Resolution of teams, agents and groups, with their starts, finishes, pads, vehicles and dynamics.

    says MC013 MC014 MC105 MC201 MC206 MC207 MC209 MC210 MC303 MC513

Agents are numbered through the mission. Starts may lie on a grid: spread evenly on a line, or in rows and columns.
``flight`` sets the pads of a team, its altitude and its speed. A vehicle is a profile by name, with changed parameters;
yaw belongs to a team. Dynamics set the kind of an agent's motion and its bounds.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import assert_never

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.defect import extension_error
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.diagnostics.suggest import Nothing
from missionc.base.extensions import INSTALL, ExtensionError, Unfit
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Dimension, Metres
from missionc.frontend.resolve.context import AGENTS, REPORTED, Context, Kind, Unresolved, ordered
from missionc.frontend.resolve.resolve_quantities import SI, excerpt, resolved_number, shown, whole, with_unit_of
from missionc.frontend.resolve.resolve_settings import known_settings, missing, only, relation, unknown_word
from missionc.frontend.resolve.resolve_shapes import NOWHERE, known, resolve_point
from missionc.frontend.syntax import ast
from missionc.ir import Vector
from missionc.ir.dynamics import DYNAMICS, KINDS, Limit, of_kind
from missionc.ir.vehicle_profiles import profiles


def on_line(first: Vector, last: Vector, count: int) -> tuple[Vector, ...]:
    """Equally spaced points from the first to the last, both included; a single point is in the middle."""
    return tuple(_between(first, last, (_part(index, count),) * len(first)) for index in range(count))


def on_grid(first: Vector, last: Vector, count: int) -> tuple[Vector, ...]:
    """Points in rows and columns between two opposite corners, both included.

    The first row runs along the first axis from the first corner, the next rows follow along the second axis, and in a
    volume layers along the third. A single row, column or layer is in the middle. The numbers of rows and columns make
    the cells as close to squares (cubes) as possible; ties go to the fewest unused grid points, then the fewest
    columns.
    """
    sides = tuple(abs(b - a) for a, b in zip(first, last, strict=True))
    counts = _counts(sides, count)
    points = []
    for index in range(count):
        parts, rest = [], index
        for length in counts:
            rest, place = divmod(rest, length)
            parts.append(_part(place, length))
        points.append(_between(first, last, tuple(parts)))
    return tuple(points)


def _part(index: int, count: int) -> float:
    return index / (count - 1) if count > 1 else 0.5


def _between(first: Vector, last: Vector, parts: tuple[float, ...]) -> Vector:
    return tuple(b if part == 1 else a + (b - a) * part for a, b, part in zip(first, last, parts, strict=True))


def _counts(sides: Vector, count: int) -> tuple[int, ...]:
    """Number of grid points along each side; one along a side of length 0."""
    long = tuple(axis for axis, side in enumerate(sides) if side > 0) or (0,)
    choices: list[dict[int, int]]
    match long:
        case (axis,):
            choices = [{axis: count}]
        case (first, second):
            choices = [{first: some, second: math.ceil(count / some)} for some in range(1, count + 1)]
        case _:
            choices = [
                {0: some, 1: others, 2: math.ceil(count / (some * others))}
                for some in range(1, count + 1)
                for others in range(1, math.ceil(count / some) + 1)
            ]
    every = [tuple(choice.get(axis, 1) for axis in range(len(sides))) for choice in choices]
    return min(every, key=lambda counts: (_stretch(sides, counts, long), math.prod(counts), counts))


def _stretch(sides: Vector, counts: tuple[int, ...], axes: tuple[int, ...]) -> float:
    """Aspect ratio of a grid cell, 1 for a square, rounded so that equal ratios compare equal."""
    gaps = [sides[axis] / max(counts[axis] - 1, 1) for axis in axes]
    return round(max(gaps) / min(gaps), 9) if min(gaps) > 0 else 1.0


FLOOR = 0.0
"""Height of every pad, metres."""


def resolve_pads(
    context: Context, flight: ast.Flight, places: tuple[ir.InitialSet, ...] | None, owner: str, count: int
) -> tuple[ir.Pad, ...]:
    """Resolved pads of ``count`` agents.

    Args:
        places: positions of the pads, one for each agent; None if the mission does not give them.
        owner: text for the team in messages.
    """
    settings = [item for item in flight.items if isinstance(item, ast.Setting)]
    known = known_settings(context, settings, tuple(ir.PAD_FIGURES), f"the `flight` of {owner}")
    values = {name: _pad_figure(context, name, setting) for name, setting in known.items()}
    hover = known.get("hover")
    if hover is not None and context.dimension == 2:
        context.report(
            code.UNKNOWN_SETTING,
            f"unexpected `hover`: in a plane, {owner} hovers at its `altitude`",
            hover.span,
            help="set `altitude` in place of `hover`",
        )
        del values["hover"]
    points = _points(context, places) if places is not None else (None,) * count
    return tuple(ir.Pad(point, flight.span, **values) for point in points)


def _pad_figure(context: Context, name: str, setting: ast.Setting) -> float:
    """Value of a pad's parameter; NaN if it is invalid, which is reported."""
    figure = ir.PAD_FIGURES[name]
    relation(context, setting, figure.relation)
    return resolved_number(context, setting.high, figure.dimension, f"the `{name}`", above=0)


def _points(context: Context, places: tuple[ir.InitialSet, ...]) -> tuple[ir.Vector, ...]:
    """Positions of the pads in the plane; a position above the floor is reported, once for equal text."""
    points, told = [], set()
    for place in places:
        assert place.point is not None
        if len(place.point) == 3 and place.point[2] > FLOOR and place.span not in told:
            told.add(place.span)
            context.report(
                code.VALUE_OUT_OF_RANGE,
                f"the pad is at a height of {shown(place.point[2])} m, not on the floor",
                place.span,
                help="give the pad height 0 and set the hover height with `hover`",
            )
        points.append(place.point[:2])
    return tuple(points)


def resolve_vehicle(context: Context, vehicle: ast.Vehicle) -> ir.Vehicle:
    """Vehicle with the named profile and the mission's changed parameters."""
    known = profiles()
    name: str | Nothing = vehicle.name.text
    if name not in known:
        name = unknown_word(context, vehicle.name, tuple(known), "`vehicle`", "profile")
    profile = known[name] if isinstance(name, str) else ir.PLAIN
    settings = known_settings(context, vehicle.settings, tuple(ir.FIGURES), f"`{profile.name}`")
    values = {key: _vehicle_figure(context, key, setting) for key, setting in settings.items()}
    return replace(profile, **values)  # type: ignore[arg-type]


def resolve_yaw(context: Context, yaw: ast.Yaw) -> ir.Yaw:
    if yaw.angle is None:
        return ir.AlongPath()
    return ir.Fixed(resolved_number(context, yaw.angle, Dimension.ANGLE, "the yaw"))


def _vehicle_figure(context: Context, name: str, setting: ast.Setting) -> float | ir.Band:
    """Value of a vehicle's parameter; NaN if it is invalid, which is reported."""
    figure, what = ir.FIGURES[name], f"the `{name}`"
    relation(context, setting, figure.relation)
    if figure.relation == "..":
        return _band(context, figure, setting, what)
    if figure.whole:
        size = whole(context, setting.high, what, least=1)
        return size if math.isnan(size) else int(size)
    if figure.above:
        return resolved_number(context, setting.high, figure.dimension, what, above=0)
    return resolved_number(context, setting.high, figure.dimension, what, least=0)


def _band(context: Context, figure: ir.Figure, setting: ast.Setting, what: str) -> ir.Band:
    high = resolved_number(context, setting.high, figure.dimension, f"the upper bound of {what}", above=0)
    if setting.low is None:
        return ir.Band(high, high)
    lower = with_unit_of(setting.low, setting.high, figure.dimension)
    low = resolved_number(context, lower, figure.dimension, f"the lower bound of {what}", least=0)
    if low >= high:
        unit = SI[figure.dimension]
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"empty range of {what}: {shown(low)}{unit} to {shown(high)}{unit}",
            setting.span,
            help="write the lower bound first",
        )
    elif figure.around and (low >= 1 or high <= 1):
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{what} from {shown(low)} to {shown(high)} excludes 1, the thrust of hovering",
            setting.span,
            help="write a range that contains 1",
        )
    return ir.Band(low, high)


def settings_of(kind: type[ir.Dynamics]) -> tuple[str, ...]:
    """Names of the settings of a kind of dynamics."""
    return ("speed", *(limit.setting for limit in kind.limits))


UNMOVED = DYNAMICS[0].of(REPORTED, REPORTED, *(REPORTED for _ in DYNAMICS[0].limits))
"""Replacement for dynamics that are invalid and have been reported."""


def resolve_dynamics(context: Context, dynamics: ast.Dynamics) -> ir.Dynamics:
    word = dynamics.name.text
    try:
        kind = KINDS.get(word)
    except ExtensionError as error:
        context.findings.append(extension_error(error, dynamics.name.span))
        return UNMOVED
    if kind is None:
        unknown_word(context, dynamics.name, tuple(KINDS), "`dynamics`", "kind", INSTALL)
        return UNMOVED
    settings = known_settings(context, dynamics.settings, settings_of(kind), f"`{word}`")
    slowest, fastest = _speeds(context, dynamics, settings)
    if slowest > 0 and not kind.may_be_restless:
        kinds = filter(None, map(KINDS.usable, KINDS))
        restless = " or ".join(f"`{each.word}`" for each in kinds if each.may_be_restless)
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the lowest speed is {shown(slowest)} m/s; only a {restless} has a lowest speed above 0",
            settings["speed"].span,
            help="write `speed <= V`",
        )
    limits = [_limit(context, dynamics, settings, limit) for limit in kind.limits]
    if any(map(math.isnan, (slowest, fastest, *limits))):
        return UNMOVED
    try:
        return of_kind(kind, slowest, fastest, *limits)
    except Unfit as error:
        context.report(code.VALUE_OUT_OF_RANGE, f"`{word}`: {error}", dynamics.span)
    except ExtensionError as error:
        context.findings.append(extension_error(error, dynamics.span))
    return UNMOVED


def _speeds(context: Context, dynamics: ast.Dynamics, settings: dict[str, ast.Setting]) -> tuple[float, float]:
    """Minimum and maximum speed of dynamics, m/s; the minimum is 0 if only an upper bound is given."""
    speed = settings.get("speed")
    if speed is None:
        missing(context, f"the speed of `{dynamics.name.text}`", dynamics.span, "write `speed <= V`")
        return REPORTED, REPORTED
    relation(context, speed, "<=", "..")
    fastest = resolved_number(context, speed.high, Dimension.SPEED, "the highest speed", above=0)
    if speed.low is None:
        return 0.0, fastest
    low = with_unit_of(speed.low, speed.high, Dimension.SPEED)
    slowest = resolved_number(context, low, Dimension.SPEED, "the lowest speed", least=0)
    if slowest > fastest:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the lowest speed, {shown(slowest)} m/s, is above the highest, {shown(fastest)} m/s",
            speed.span,
            help=f"write `speed {shown(fastest)}..{shown(slowest)} m/s`",
            fix=Fix(speed.span, f"speed {shown(fastest)}..{shown(slowest)} m/s"),
        )
        return REPORTED, REPORTED
    return slowest, fastest


def _limit(context: Context, dynamics: ast.Dynamics, settings: dict[str, ast.Setting], limit: Limit) -> float:
    setting = settings.get(limit.setting)
    if setting is None and limit.default is not None:
        return limit.default
    if setting is None:
        way_out = f"write `{limit.setting} <= {limit.setting[0].upper()}`"
        missing(context, f"the {limit.setting} of `{dynamics.name.text}`", dynamics.span, way_out)
        return REPORTED
    relation(context, setting, "<=")
    return resolved_number(context, setting.high, limit.dimension, limit.name, above=0)


ALTITUDE = Metres(1.0)
"""Default altitude of an agent in a plane mission."""


class NoFinish(Record):
    """Marker for an agent without a finish."""


NO_FINISH = NoFinish()


# --------------------------------------------------------------------- teams


def resolve_teams(context: Context) -> None:
    """Resolve the agents of every team; none if there are more than the limit."""
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
    """Return whether the mission has too many agents, which is reported at the team that exceeds the limit."""
    total = 0.0
    for team in teams:
        size = context.sizes[team.name.text]
        total += 0 if math.isnan(size) else size
        if total > context.limits.agents:
            context.report(
                code.TOO_MANY_AGENTS,
                f"the mission has {shown(total)} agents; the limit is {context.limits.agents}",
                (team.size or team.name).span,
                help="raise the limit with `--limit agents=VALUE`",
            )
            return True
    return False


def _team(context: Context, team: ast.Team, size: float) -> None:
    """Resolve a team and add its agents; with a size of NaN its items are checked and no agent is added."""
    name = team.name.text
    owner = f"`{name}`"
    settings = known_settings(
        context, [item for item in team.items if isinstance(item, ast.Setting)], _settings(context), owner
    )
    flown = only(context, team.items, ast.Vehicle)
    vehicle = context.vehicle if flown is None else resolve_vehicle(context, flown)
    turns = only(context, team.items, ast.Yaw)
    yaw = ir.AHEAD if turns is None else resolve_yaw(context, turns)
    radius = _length(context, settings.get("radius"), Metres(vehicle.radius), f"the radius of {owner}")
    altitude = _length(context, settings.get("altitude"), ALTITUDE, f"the altitude of {owner}")
    moves = only(context, team.items, ast.Dynamics)
    starts = only(context, team.items, ast.Start)
    ends = only(context, team.items, ast.Finish)
    dynamics: ir.Dynamics = UNMOVED
    if moves is not None:
        dynamics = resolve_dynamics(context, moves)
    else:
        missing(
            context,
            f"the `dynamics` of {owner}",
            team.name.span,
            "add, for example, `dynamics single_integrator(speed <= 1 m/s)`",
        )
    start: tuple[ir.InitialSet, ...] = ()
    if starts is not None:
        start = _places(context, starts.places, size, owner)
    else:
        missing(context, f"the `start` of {owner}", team.name.span, "add `start in REGION`")
    finish = NO_FINISH if ends is None else _places(context, ends.places, size, owner)
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
    """Pads of a team, one for each agent; empty if the team has no ``flight``."""
    flight = only(context, team.items, ast.Flight)
    if flight is None:
        return ()
    said = only(context, flight.items, ast.Pads)
    places = _places(context, said.places, size, owner) if said is not None else None
    return resolve_pads(context, flight, places, owner, 0 if math.isnan(size) else int(size))


def _settings(context: Context) -> tuple[str, ...]:
    """Names of the allowed settings of a team; in a volume the altitude of an agent is its third coordinate."""
    return ("radius",) if context.dimension == 3 else ("radius", "altitude")


def _length(context: Context, setting: ast.Setting | None, default: Metres, what: str) -> Metres:
    if setting is None:
        return default
    relation(context, setting, "", "=")
    return Metres(resolved_number(context, setting.high, Dimension.LENGTH, what, least=0))


# --------------------------------------------------------------------- places


def _places(context: Context, places: ast.Places, size: float, owner: str) -> tuple[ir.InitialSet, ...]:
    """Start, finish or pad of each agent of a team, in index order; empty if the size is NaN."""
    count = 0 if math.isnan(size) else int(size)
    match places:
        case ast.InRegion(region=name):
            declared = context.find(name, Kind.REGION)
            region = context.regions.get(name.text, ir.Region(name.text, NOWHERE, name.span))
            return () if isinstance(declared, Unresolved) else (ir.InitialSet(places.span, region=region),) * count
        case ast.AtPoints(points=points):
            here = tuple(ir.InitialSet(point.span, resolve_point(context, point)) for point in points)
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
        case ast.AtListed():  # the contents of the file replaced it, or are reported
            return ()
        case _:
            assert_never(places)


def _exactly(points: tuple[ir.Vector, ...], span: Span) -> tuple[ir.InitialSet, ...]:
    return tuple(ir.InitialSet(span, point) for point in points)


def _sound(ends: tuple[ir.Vector, ir.Vector]) -> bool:
    return len(ends[0]) == len(ends[1]) and known(*ends)


def _not_one_each(context: Context, places: ast.AtPoints, owner: str, agents: int) -> None:
    context.report(
        code.VALUE_OUT_OF_RANGE,
        f"{owner} has {agents} {'agent' if agents == 1 else 'agents'} and {len(places.points)} positions",
        places.span,
        help="give one position for each agent",
    )


# ------------------------------------------------------------ sets of agents


def resolve_groups(context: Context) -> None:
    """Resolve the agents of every group, in the order named.

    An agent that is named twice counts once, at its first occurrence.
    """
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
    """Agents that a name or a member refers to; empty if the reference is invalid, which is reported."""
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
    """Agents of a team from one index to another; an empty set if the range is invalid, which is reported."""
    team = member.team.text
    size = context.sizes.get(team, math.nan)
    match member.low:
        case ast.Arithmetic(span, "-", ast.Number(unit=None) as first, ast.Number(unit=None) as last):
            context.report(
                code.NO_SUCH_MEMBER,
                f"expected a range of members, found the difference `{excerpt(span)}`",
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
            f"bounds reversed: {shown(low)} is greater than {shown(high)}",
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
    """Return whether groups and ranges may expand to ``count`` more agents; the first excess is reported."""
    limit = context.limits.formula_nodes
    before = context.members
    context.members += count
    if before <= limit < context.members:
        context.report(
            code.TOO_LARGE_TO_EXPAND,
            f"the expanded groups and ranges have {context.members} agents so far; the limit is {limit}",
            span,
            help="raise the limit with `--limit formula_nodes=VALUE`",
        )
    return context.members <= limit


def _no_such_member(context: Context, member: ast.Member, index: int, size: int) -> None:
    team = member.team.text
    last = f"{team}[0]" if size == 1 else f"{team}[0]` … `{team}[{size - 1}]"
    context.report(
        code.NO_SUCH_MEMBER,
        f"unknown agent `{team}[{index}]`: `{team}` has {size} {'agent' if size == 1 else 'agents'}",
        member.span,
        labels=(Label(context.names.declared[team].span, "declared here"),),
        help=f"name `{last}`",
    )
