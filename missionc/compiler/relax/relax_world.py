"""Relaxations of a mission by kind: its world, its formulas, and its time.

The world: graphs, formations, regions, clearance between bodies, and the number of agents. Formulas: bounds of routes,
counts, comparisons, or a dropped requirement. Time: a longer horizon, a window that ends later or requires less time, a
longer period.
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc import ir
from missionc.base.diagnostics.model import Fix
from missionc.base.source import Span
from missionc.base.units import Metric
from missionc.compiler.front_end import Checked
from missionc.compiler.relax.edits import (
    ROUND,
    ConflictTarget,
    ConflictTargets,
    Edit,
    RelaxationParameter,
    Spot,
    declared,
    is_in_main_file,
    less,
    more,
    notch,
    spot,
    whole,
)
from missionc.frontend.checks.check_horizons import steps_ahead
from missionc.frontend.resolve.resolve_quantities import excerpt, shown
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.references import nodes
from missionc.ir import Apply, Mission, Period, Preference, Requirement, Window
from missionc.ir.language.walk_formulas import formulas, formulas_bottom_up, goals, operator_words
from missionc.ir.language.weighed_routes import longest


def without(checked: Checked, mission: Mission, conflict: tuple[str, ...]) -> list[RelaxationParameter]:
    """Relaxations that drop one conflicting requirement each; requirements of one family are dropped together."""
    spans = {goal.name: replace(goal.span, turns=()) for goal in mission.requirements}
    one_of_each = {spans.get(name, name): name for name in reversed(conflict)}
    return [knob for name in reversed(one_of_each.values()) for knob in without_all(checked, mission, (name,))]


def without_all(checked: Checked, mission: Mission, names: tuple[str, ...]) -> list[RelaxationParameter]:
    """Relaxation that drops all of these requirements together, as a list; empty if one is not in the main file."""
    goals = [goal for goal in mission.requirements if goal.name in names]
    if not goals or not all(is_in_main_file(checked, goal.span) for goal in goals):
        return []
    spans = dict.fromkeys(replace(goal.span, turns=()) for goal in goals)
    says = " and ".join(dict.fromkeys(_left_out(goal) for goal in goals))
    edit = Edit(f"without {says}", tuple(Fix(span, "") for span in spans))
    return [RelaxationParameter(lambda notches: edit, size=math.inf)]


def _left_out(goal: ir.Requirement) -> str:
    return f"all of `{goal.name.partition('[')[0]}`" if goal.span.turns else f"`{goal.name}`"


def lengths(checked: Checked, mission: Mission, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of routes' upper bounds: more hops or metres for required routes, fewer for forbidden ones."""
    written = {node.span: node.bounds for node in nodes(checked.program) if isinstance(node, ast.Apply)}
    meant = {each.span: each.bounds for each in formulas(mission) if isinstance(each, ir.Apply)}
    knobs = []
    for span, way in targets.lengths.items():
        length, bounds = written.get(span), meant.get(span)
        if not isinstance(length, ast.Length) or not isinstance(bounds, ir.Length) or way is ConflictTarget.EITHER:
            continue
        bound = spot(checked, length.high)
        if bound is None:
            continue
        name = f"the bound of `{excerpt(length.span)}`"
        counted = bounds.metric is not Metric.METRES
        if counted and way is ConflictTarget.MORE:
            knobs.append(whole(bound, name, int(longest(bounds)) - int(bounds.high)))
        elif counted:
            knobs.append(whole(bound, name, int(bounds.high - bounds.low), -1))
        else:
            knobs.append(
                more(bound, name) if way is ConflictTarget.MORE else less(bound, name, bounds.low / bound.factor)
            )
    return knobs


def counts(checked: Checked, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of required numbers of agents, in ``count[…] f >= 2`` and ``at least 2 drone: f``."""
    knobs = []
    for node in _in_order(checked):
        match node:
            case ast.Apply(span=span, number=ast.Number() | ast.Name() as number):
                name = f"the bound of `{excerpt(span)}`"
            case ast.Quantified(span=span, number=ast.Number() | ast.Name() as number, agents=agents):
                name = f"at least, of `{excerpt(agents.span)}`,"
            case _:
                continue
        way, bound = targets.counts.get(span, ConflictTarget.EITHER), spot(checked, number)
        if bound is not None and way is ConflictTarget.LESS:
            knobs.append(whole(bound, name, int(bound.value), -1))
        elif bound is not None and way is ConflictTarget.MORE:
            knobs.append(whole(bound, name, max(1, int(bound.value))))
    return knobs


def headings(checked: Checked, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of the angles of heading requirements."""
    knobs = []
    for node in sorted(
        (each for each in nodes(checked.program) if isinstance(each, ast.Facing)), key=lambda each: each.span.start
    ):
        way, angle = targets.comparisons.get(node.span, ConflictTarget.EITHER), spot(checked, node.within)
        if angle is None or way is ConflictTarget.EITHER:
            continue
        name = f"the angle of `{excerpt(node.span)}`"
        most = math.nextafter(math.pi / angle.factor, 0.0)
        knobs.append(more(angle, name, most) if way is ConflictTarget.MORE else less(angle, name))
    return knobs


def _in_order(checked: Checked) -> list[ast.Apply | ast.Quantified | ast.Compare]:
    """Formulas of the text that may contain a number, in the order of the text."""
    kinds = (ast.Apply, ast.Quantified, ast.Compare)
    return sorted(
        (node for node in nodes(checked.program) if isinstance(node, kinds)), key=lambda node: node.span.start
    )


def comparisons(checked: Checked, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of the numbers in comparisons."""
    knobs = []
    for node in (each for each in _in_order(checked) if isinstance(each, ast.Compare)):
        way = targets.comparisons.get(node.span, ConflictTarget.EITHER)
        right, left = spot(checked, node.right), spot(checked, node.left)
        bound = right or left
        if bound is None or way is ConflictTarget.EITHER:
            continue
        grows = ((node.operator in ("<", "<=")) == (bound is right)) == (way is ConflictTarget.MORE)
        name = f"the bound of `{excerpt(node.span)}`"
        knobs.append(more(bound, name) if grows else less(bound, name, bound.value - 4 * max(1.0, abs(bound.value))))
    return knobs


LONGER = 4
"""Maximum factor by which the horizon is extended."""


def horizon(checked: Checked, mission: Mission) -> list[RelaxationParameter]:
    """Relaxation that extends the horizon by complete steps; windows to the mission's end are extended too."""
    horizon_spot = _horizon(checked)
    if horizon_spot is None:
        return []
    ends = [end for end in _ends(checked, mission) if end != horizon_spot]

    def edit(notches: int) -> Edit:
        steps = mission.steps + notches
        whole = _lasting(horizon_spot, mission, steps)
        fixes = [fix for end in ends for fix in _at_spot(end, mission, steps, "").fixes]
        says = f"{whole.says}, with the windows that end with it" if fixes else whole.says
        return Edit(says, (*whole.fixes, *fixes), whole.overrides)

    return [RelaxationParameter(edit, 1 / mission.steps, mission.steps, (LONGER - 1) * mission.steps)]


def _ends(checked: Checked, mission: Mission) -> list[Spot]:
    """Locations at which the mission's last step is written as the end of a window, each once."""
    meant = _meant(mission)
    ends = []
    for node in nodes(checked.program):
        if isinstance(node, ast.Apply) and isinstance(node.bounds, ast.Window) and node.span in meant:
            bounds, end = meant[node.span].bounds, spot(checked, node.bounds.high)
            if isinstance(bounds, Window) and bounds.high == mission.steps and end is not None and end not in ends:
                ends.append(end)
    return ends


def _meant(mission: Mission) -> dict[Span, Apply]:
    """Resolved form of each use of an operator, by its source span."""
    return {each.span: each for each in formulas(mission) if isinstance(each, Apply)}


def windows(checked: Checked, mission: Mission, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of the ends of windows, later for events and earlier for durations, and of periods."""
    written = {node.span: node.bounds for node in nodes(checked.program) if isinstance(node, ast.Apply)}
    periods = _periods(checked)
    meant = _meant(mission)
    knobs = []
    for span, way in targets.windows.items():
        window, formula = written.get(span), meant.get(span)
        if isinstance(window, ast.Window) and formula is not None and way is not ConflictTarget.EITHER:
            knobs.append(_window(checked, mission, window, formula, way))
        elif (
            formula is not None
            and isinstance(formula.bounds, Period)
            and way is ConflictTarget.MORE
            and span in periods
        ):
            knobs.append(_period(checked, mission, periods[span], formula))
    return [knob for knob in knobs if knob is not None]


def _window(
    checked: Checked, mission: Mission, window: ast.Window, formula: Apply, way: ConflictTarget
) -> RelaxationParameter | None:
    bounds, lasting = formula.bounds, _horizon(checked)
    if not isinstance(bounds, Window) or bounds.high is None or window.high is None:
        return None
    low, high = bounds.low, bounds.high
    end_spot = spot(checked, window.high)
    with_horizon = end_spot is not None and end_spot == lasting
    if end_spot is None or with_horizon:
        if (way is ConflictTarget.MORE and with_horizon) or not is_in_main_file(checked, window.high.span):
            return None
        end_spot = Spot(high * mission.step, "s", window.high)
    asking = [goal for goal in goals(mission) if formula in formulas_bottom_up([goal.formula])]
    name = f"in `{asking[0].name}`, the end of `{' '.join(operator_words(formula).text.split())}` at"
    ahead = _ahead(mission, asking)

    def edit(notches: int) -> Edit | None:
        end = high + way.value * notches
        moved = _at_spot(end_spot, mission, end, name)
        if way is ConflictTarget.LESS or ahead + notches <= mission.steps:
            return moved
        return moved + _lasting(lasting, mission, ahead + notches) if lasting is not None else None

    most = (LONGER - 1) * mission.steps if way is ConflictTarget.MORE else high - low
    return RelaxationParameter(edit, 1 / max(1, high), min(most, max(1, high)), most) if most else None


def _periods(checked: Checked) -> dict[Span, ast.Quantity]:
    """Period of each recurrent formula of the text, by the formula's span: a quantity, or the name of a parameter."""
    found: dict[Span, ast.Quantity] = {}
    for node in nodes(checked.program):
        match node:
            case ast.Apply(span=span, bounds=ast.Period(length=length)):
                found[span] = length
            case ast.Quantified(span=span, kind="every", agents=ast.Name() as name):
                found[span] = name
            case _:
                pass
    return found


def _period(checked: Checked, mission: Mission, length: ast.Quantity, formula: Apply) -> RelaxationParameter | None:
    """Relaxation that extends a period by complete steps, within the mission's duration; None if impossible."""
    place = spot(checked, length)
    assert isinstance(formula.bounds, Period)
    steps = formula.bounds.steps
    asking = [goal for goal in goals(mission) if formula in formulas_bottom_up([goal.formula])]
    most = mission.steps - _ahead(mission, asking)
    if place is None or most < 1:
        return None
    name = f"in `{asking[0].name}`, the period"
    return RelaxationParameter(
        lambda notches: _at_spot(place, mission, steps + notches, name), 1 / steps, min(most, steps), most
    )


def _ahead(mission: Mission, asking: list[Requirement | Preference]) -> int:
    """Number of steps that these goals look ahead."""
    looks = steps_ahead(goal.formula for goal in asking)
    return int(min(max(looks[goal.formula].total for goal in asking), mission.steps))


def _horizon(checked: Checked) -> Spot | None:
    times = declared(checked, ast.Time)
    return spot(checked, times[0].horizon) if times else None


def _lasting(horizon_spot: Spot, mission: Mission, steps: int) -> Edit:
    return _at_spot(horizon_spot, mission, steps, "horizon")


def _at_spot(place: Spot, mission: Mission, steps: int, name: str) -> Edit:
    """Edit that sets a time to ``steps`` steps, in the unit of the text."""
    value = steps if place.unit == "steps" else steps * mission.step / place.factor
    return place.put(value, f"{name} {place.written(value)} instead of {place.written(place.value)}")


MORE_AGENTS = 3
"""Maximum number of agents that a relaxation adds to a team."""

FINER = 1.7
"""Factor of the number of nodes, relative to the finest roadmap without a plan."""


def graphs(checked: Checked, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of communication graphs: larger radii and ranges for required links, smaller ones for forbidden
    links.
    """
    knobs = []
    for graph in declared(checked, ast.Graph):
        way = targets.graphs.get(graph.name.text)
        written = [(f"the radius of `{graph.name.text}`", graph.radius)] if graph.radius is not None else []
        written += [
            (
                f"the range of `{graph.name.text}` from `{excerpt(p.senders.span)}` to `{excerpt(p.receivers.span)}`",
                p.value,
            )
            for p in graph.ranges
        ]
        for name, quantity in written:
            radius = spot(checked, quantity)
            if radius is not None and way is not None:
                knobs.append(
                    less(radius, name, notch(radius.value)) if way is ConflictTarget.LESS else more(radius, name)
                )
    return knobs


def formations(checked: Checked, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations of the tolerances of formations."""
    knobs = []
    for formation in declared(checked, ast.Formation):
        for setting in formation.settings:
            tolerance = spot(checked, setting.high) if setting.name.text == "tolerance" else None
            if tolerance is not None and targets.formations.get(formation.name.text) is ConflictTarget.MORE:
                knobs.append(more(tolerance, f"the tolerance of `{formation.name.text}`"))
    return knobs


def regions(checked: Checked, mission: Mission, targets: ConflictTargets) -> list[RelaxationParameter]:
    """Relaxations that enlarge required regions on all sides: boxes within the world, discs and balls."""
    meant = {region.name: region.shape for region in mission.regions}
    knobs = []
    for region in declared(checked, ast.Region):
        name, shape = region.name.text, meant.get(region.name.text)
        if targets.regions.get(name) is not ConflictTarget.MORE:
            continue
        match region.shape, shape:
            case ast.Box() as box, ir.Box() if is_in_main_file(checked, box.span):
                knobs.append(_wider_box(name, box, shape, mission))
            case (ast.Disc() | ast.Ball()) as round_, _:
                radius = spot(checked, round_.radius)
                knobs += [more(radius, f"the radius of `{name}`")] if radius is not None else []
            case _:
                pass
    return knobs


def _wider_box(name: str, box: ast.Box, shape: ir.Box, mission: Mission) -> RelaxationParameter:
    """Relaxation that enlarges a box on all sides, written with the coordinates of the text."""
    side = min(high - low for low, high in zip(shape.low, shape.high, strict=True))
    by, axes = notch(side), range(len(box.low.coordinates))
    world = mission.world

    def edit(notches: int) -> Edit:
        low = [max(world.low[axis], shape.low[axis] - notches * by) for axis in axes]
        high = [min(world.high[axis], shape.high[axis] + notches * by) for axis in axes]
        fixes = Fix(box.low.span, _point(low)), Fix(box.high.span, _point(high))
        return Edit(f"`{name}` larger by {shown(round(notches * by, ROUND))} m to each side", fixes)

    most = math.floor(2 * side / by)
    return RelaxationParameter(edit, by / side, max(1, most // 2), most)


def _point(values: list[float]) -> str:
    return f"({', '.join(shown(round(value, ROUND)) for value in values)})"


def margins(checked: Checked) -> list[RelaxationParameter]:
    """Relaxations that reduce the required separation and clearance of bodies."""
    knobs = []
    room: list[ast.Separation | ast.Clearance] = [*declared(checked, ast.Separation), *declared(checked, ast.Clearance)]
    for item in room:
        name, distance = item.span.text.split(maxsplit=1)[0], spot(checked, item.distance)
        if distance is not None and distance.value > 0:
            knobs.append(less(distance, name))
    return knobs


def teams(checked: Checked) -> list[RelaxationParameter]:
    """Relaxations that add one to three agents to a team."""
    sizes = [(team.name.text, spot(checked, team.size)) for team in declared(checked, ast.Team)]
    return [whole(size, f"the size of team `{name}`", MORE_AGENTS) for name, size in sizes if size is not None]


def roadmap(checked: Checked, nodes: int) -> list[RelaxationParameter]:
    """Relaxation that uses a finer roadmap; empty if the user provides the roadmap.

    Args:
        nodes: number of nodes of the finest roadmap without a plan.
    """
    if checked.mission is not None and checked.mission.solve.roadmap is not None:
        return []  # it is the mission's own
    finer = round(nodes * FINER)
    says = f"a finer roadmap, of {finer} nodes"
    solves = declared(checked, ast.Solve)
    settings = {setting.name.text: setting for setting in (solves[0].settings if solves else ())}
    if "nodes" in settings:
        node_count = spot(checked, settings["nodes"].high)
        edit = node_count.put(finer, says) if node_count is not None else None
    elif settings:
        setting = next(iter(settings.values())).span
        edit = _at(checked, Span(setting.source, setting.start, setting.start), f"nodes = {finer}, ", says)
    elif solves:
        edit = _at(checked, solves[0].span, f"solve with smt {{ nodes = {finer} }}", says)
    else:
        source = checked.sources[0]
        end = Span(source, len(source.text), len(source.text))
        line = "" if source.text.endswith("\n") else "\n"
        edit = Edit(says, (Fix(end, f"{line}solve with smt {{ nodes = {finer} }}\n"),))
    return [RelaxationParameter(lambda notches: edit, 0.0)] if edit is not None else []


def _at(checked: Checked, span: Span, text: str, says: str) -> Edit | None:
    return Edit(says, (Fix(span, text),)) if is_in_main_file(checked, span) else None
