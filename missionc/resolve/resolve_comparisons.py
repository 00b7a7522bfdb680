"""Resolution of comparisons: both sides brought to one linear expression over states and distances.

says MC104 MC201 MC204 MC205 MC210
"""

from __future__ import annotations

from fractions import Fraction

from missionc import ir
from missionc.base.units import Dimension
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix, Label
from missionc.ir import About
from missionc.resolve.amounts import PLAIN, Amount
from missionc.resolve.context import Context
from missionc.resolve.names import AGENTS, UNRESOLVED, Declared, Kind, Unresolved
from missionc.resolve.resolve_agents import resolve_set
from missionc.resolve.resolve_points import counted
from missionc.resolve.resolve_quantities import MINUS, NO_AMOUNT, POWERS, added, evaluate, excerpt, is_reported, scaled
from missionc.resolve.typed import Typed
from missionc.syntax import ast

AXES = {"x": 0, "y": 1, "z": 2}
NOTHING = Fraction(0)


def resolve_comparison(context: Context, comparison: ast.Compare) -> Typed:
    """``left >= right`` as ``left - right >= 0``, ``left <= right`` as ``right - left >= 0``."""
    left = evaluate(context, comparison.left, state_of)
    right = evaluate(context, comparison.right, state_of)
    amount = added(context, comparison, left, scaled(right, MINUS))
    if comparison.operator in ("<", "<="):
        amount = scaled(amount, MINUS)
    stand_in = Typed(ir.Truth(True, comparison.span), About.EITHER, comparison.span)
    if is_reported(amount):
        return stand_in
    if not amount.terms:
        _nothing_changes(context, comparison)
        return stand_in
    features = [feature for _, feature in amount.terms]
    between = [feature for feature in features if isinstance(feature, ir.DistanceBetween)]
    if between and len(between) < len(features):
        _mixed(context, comparison)
        return stand_in
    about = About.TEAM if between else About.AGENT
    predicate = ir.Compare(amount.terms, amount.constant + 0.0, comparison.operator in ("<", ">"))
    return Typed(ir.Holds(predicate, comparison.span), about, comparison.span)


def state_of(context: Context, state: ast.Name | ast.Distance) -> Amount:
    """A state word or a distance, with its unit."""
    match state:
        case ast.Distance():
            return _distance(context, state)
        case ast.Name(text="speed"):
            return Amount(NOTHING, POWERS[Dimension.SPEED], ((1.0, ir.Speed()),))
        case ast.Name(text="altitude"):
            return Amount(NOTHING, POWERS[Dimension.LENGTH], ((1.0, ir.Altitude()),))
        case ast.Name(text=text) if text in context.resources:
            return Amount(NOTHING, PLAIN, ((1.0, ir.Level(context.resources[text])),))
        case ast.Name(text=text) if context.dimension == 2 and AXES[text] == 2:
            context.report(
                code.WRONG_DIMENSION,
                f"`{text}` is the third coordinate; the world has {counted(2)}",
                state.span,
                help="write `altitude`, or give the world three coordinates",
                fix=Fix(state.span, "altitude"),
            )
            return NO_AMOUNT
        case ast.Name(text=text):
            return Amount(NOTHING, POWERS[Dimension.LENGTH], ((1.0, ir.Coordinate(AXES[text])),))


def _distance(context: Context, distance: ast.Distance) -> Amount:
    feature: ir.Feature | Unresolved
    match distance.ends:
        case (end,):
            feature = _distance_to(context, end)
        case (first, second):
            feature = _distance_between(context, distance, first, second)
        case ends:
            context.report(
                code.WRONG_KIND,
                f"a distance has one end or two; here are {len(ends)}",
                distance.span,
                help="write `distance(base)` or `distance(drone[0], drone[1])`",
            )
            return NO_AMOUNT
    return (
        NO_AMOUNT if isinstance(feature, Unresolved) else Amount(NOTHING, POWERS[Dimension.LENGTH], ((1.0, feature),))
    )


def _distance_to(context: Context, end: ast.Name | ast.Member) -> ir.DistanceTo | Unresolved:
    if isinstance(end, ast.Name):
        place = context.regions.get(end.text) or context.beacons.get(end.text)
        if place is not None:
            return ir.DistanceTo(place)
    agent = one_agent(context, end, "a region, a beacon or one agent", Kind.REGION, Kind.BEACON)
    return agent if isinstance(agent, Unresolved) else ir.DistanceTo(agent)


def _distance_between(
    context: Context, distance: ast.Distance, first: ast.Name | ast.Member, second: ast.Name | ast.Member
) -> ir.DistanceBetween | Unresolved:
    one = one_agent(context, first, "one agent")
    if isinstance(one, Unresolved):
        return UNRESOLVED
    other = one_agent(context, second, "one agent")
    if isinstance(other, Unresolved):
        return UNRESOLVED
    if one == other:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            "an agent is at no distance from itself",
            distance.span,
            help="name two agents",
        )
        return UNRESOLVED
    return ir.DistanceBetween(min(one, other), max(one, other))


def one_agent(context: Context, reference: ast.Name | ast.Member, needed: str, *also: Kind) -> int | Unresolved:
    """The index of the one agent a reference names."""
    name = reference if isinstance(reference, ast.Name) else reference.team
    declared = context.find(name, *AGENTS, *also, needed=needed)
    if isinstance(declared, Unresolved):
        return UNRESOLVED
    several = isinstance(reference, ast.Member) and reference.high is not None
    if several or (isinstance(reference, ast.Name) and declared.kind is not Kind.AGENT):
        _several(context, reference, declared, needed)
        return UNRESOLVED
    agents = resolve_set(context, reference).agents
    return agents[0] if agents else UNRESOLVED


# ------------------------------------------------------------------ messages


def _nothing_changes(context: Context, comparison: ast.Compare) -> None:
    context.report(
        code.WRONG_KIND,
        f"nothing in `{excerpt(comparison.span)}` changes with time",
        comparison.span,
        help="compare a state (`x`, `y`, `z`, `speed`, `altitude`) or a `distance(…)`",
    )


def _mixed(context: Context, comparison: ast.Compare) -> None:
    context.report(
        code.QUANTIFIER_TOO_MANY,
        f"`{excerpt(comparison.span)}` compares one agent's own state with a distance between two named agents",
        comparison.span,
        help="make two comparisons of it, each about one of them",
    )


def _several(context: Context, reference: ast.Name | ast.Member, declared: Declared, needed: str) -> None:
    kind = declared.kind.value if isinstance(reference, ast.Name) else "several agents"
    team = declared.declaration.name.text if declared.kind is Kind.TEAM else "drone"
    context.report(
        code.WRONG_KIND,
        f"`{excerpt(reference.span)}` is {kind}; {needed} is needed here",
        reference.span,
        labels=(Label(declared.span, "declared here"),),
        help=f"name one agent, as in `{team}[0]`",
    )
