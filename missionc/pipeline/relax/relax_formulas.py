"""Relaxations of formulas: bounds of routes, counts, comparisons, or a requirement left out."""

from __future__ import annotations

import math
from dataclasses import replace

from missionc import ir
from missionc.diagnostics.model import Fix
from missionc.ir import Mission
from missionc.language.route_lengths import longest
from missionc.language.walk_formulas import formulas
from missionc.pipeline.checked import Checked
from missionc.pipeline.relax.conflict_targets import ConflictTargets, Way
from missionc.pipeline.relax.edits import Edit, is_in_main_file, spot
from missionc.pipeline.relax.knobs import Knob, less, more, whole
from missionc.resolve.resolve_quantities import excerpt
from missionc.syntax import ast
from missionc.syntax.references import nodes


def without(checked: Checked, mission: Mission, conflict: tuple[str, ...]) -> list[Knob]:
    """Each of the requirements in conflict left out; a family once, whichever of its members are in conflict."""
    spans = {goal.name: replace(goal.span, turns=()) for goal in mission.requirements}
    one_of_each = {spans.get(name, name): name for name in reversed(conflict)}
    return [knob for name in reversed(one_of_each.values()) for knob in without_all(checked, mission, (name,))]


def without_all(checked: Checked, mission: Mission, names: tuple[str, ...]) -> list[Knob]:
    """All of these requirements left out together; with a member of a family, the whole family."""
    goals = [goal for goal in mission.requirements if goal.name in names]
    if not goals or not all(is_in_main_file(checked, goal.span) for goal in goals):
        return []
    spans = dict.fromkeys(replace(goal.span, turns=()) for goal in goals)
    says = " and ".join(dict.fromkeys(_left_out(goal) for goal in goals))
    edit = Edit(f"without {says}", tuple(Fix(span, "") for span in spans))
    return [Knob(lambda notches: edit, size=math.inf)]


def _left_out(goal: ir.Requirement) -> str:
    return f"all of `{goal.name.partition('[')[0]}`" if goal.span.turns else f"`{goal.name}`"


def lengths(checked: Checked, mission: Mission, targets: ConflictTargets) -> list[Knob]:
    """The upper bounds of routes: more hops or metres where a route is to be there, fewer where none is."""
    written = {node.span: node.bounds for node in nodes(checked.program) if isinstance(node, ast.Apply)}
    meant = {each.span: each.bounds for each in formulas(mission) if isinstance(each, ir.Apply)}
    knobs = []
    for span, way in targets.lengths.items():
        length, bounds = written.get(span), meant.get(span)
        if not isinstance(length, ast.Length) or not isinstance(bounds, ir.Length) or way is Way.EITHER:
            continue
        bound = spot(checked, length.high)
        if bound is None:
            continue
        name = f"the bound of `{excerpt(length.span)}`"
        counted = bounds.metric is not ast.Metric.METRES
        if counted and way is Way.MORE:
            knobs.append(whole(bound, name, int(longest(bounds)) - int(bounds.high)))
        elif counted:
            knobs.append(whole(bound, name, int(bounds.high - bounds.low), -1))
        else:
            knobs.append(more(bound, name) if way is Way.MORE else less(bound, name, bounds.low / bound.factor))
    return knobs


def counts(checked: Checked, targets: ConflictTargets) -> list[Knob]:
    """How many agents, in ``count[…] f >= 2`` and ``at least 2 drone: f``."""
    knobs = []
    for node in _in_order(checked):
        match node:
            case ast.Apply(span=span, number=ast.Number() | ast.Name() as number):
                name = f"the bound of `{excerpt(span)}`"
            case ast.Quantified(span=span, number=ast.Number() | ast.Name() as number, agents=agents):
                name = f"at least, of `{excerpt(agents.span)}`,"
            case _:
                continue
        way, bound = targets.counts.get(span, Way.EITHER), spot(checked, number)
        if bound is not None and way is Way.LESS:
            knobs.append(whole(bound, name, int(bound.value), -1))
        elif bound is not None and way is Way.MORE:
            knobs.append(whole(bound, name, max(1, int(bound.value))))
    return knobs


def headings(checked: Checked, targets: ConflictTargets) -> list[Knob]:
    """The angle to either side within which a heading is to be."""
    knobs = []
    for node in sorted(
        (each for each in nodes(checked.program) if isinstance(each, ast.Facing)), key=lambda each: each.span.start
    ):
        way, angle = targets.comparisons.get(node.span, Way.EITHER), spot(checked, node.within)
        if angle is None or way is Way.EITHER:
            continue
        name = f"the angle of `{excerpt(node.span)}`"
        most = math.nextafter(math.pi / angle.factor, 0.0)
        knobs.append(more(angle, name, most) if way is Way.MORE else less(angle, name))
    return knobs


def _in_order(checked: Checked) -> list[ast.Apply | ast.Quantified | ast.Compare]:
    """The formulas as written that may have a number of their own."""
    kinds = (ast.Apply, ast.Quantified, ast.Compare)
    return sorted(
        (node for node in nodes(checked.program) if isinstance(node, kinds)), key=lambda node: node.span.start
    )


def comparisons(checked: Checked, targets: ConflictTargets) -> list[Knob]:
    """The number that a comparison has on one of its sides."""
    knobs = []
    for node in (each for each in _in_order(checked) if isinstance(each, ast.Compare)):
        way = targets.comparisons.get(node.span, Way.EITHER)
        right, left = spot(checked, node.right), spot(checked, node.left)
        bound = right or left
        if bound is None or way is Way.EITHER:
            continue
        grows = ((node.operator in ("<", "<=")) == (bound is right)) == (way is Way.MORE)
        name = f"the bound of `{excerpt(node.span)}`"
        knobs.append(more(bound, name) if grows else less(bound, name, bound.value - 4 * max(1.0, abs(bound.value))))
    return knobs
