"""Resolution of ``flight``: where the agents of a team stand, how high they rise, and how fast.

says MC013 MC206 MC209 MC210
"""

from __future__ import annotations

from missionc import ir
from missionc.diagnostics import code
from missionc.resolve.context import Context
from missionc.resolve.resolve_quantities import number, shown
from missionc.resolve.resolve_settings import known_settings, relation, said_twice
from missionc.syntax import ast

FLOOR = 0.0
"""Metres: the height of every pad."""


def pads_of(context: Context, flight: ast.Flight) -> ast.Pads | None:
    """The one place where it says its pads; a second one is reported."""
    pads = [item for item in flight.items if isinstance(item, ast.Pads)]
    for again in pads[1:]:
        said_twice(context, "`pads`", again.span, pads[0].span)
    return pads[0] if pads else None


def resolve_pads(
    context: Context, flight: ast.Flight, places: tuple[ir.Place, ...] | None, owner: str, count: int
) -> tuple[ir.Pad, ...]:
    """A pad for each of so many agents.

    Args:
        places: of the pads, as many; None where the mission does not say.
    """
    settings = [item for item in flight.items if isinstance(item, ast.Setting)]
    known = known_settings(context, settings, tuple(ir.PAD_FIGURES), f"the `flight` of {owner}")
    values = {name: _value(context, name, setting) for name, setting in known.items()}
    hover = known.get("hover")
    if hover is not None and context.dimension == 2:
        context.report(
            code.UNKNOWN_SETTING,
            f"{owner} flies in a plane, and hovers at its `altitude`",
            hover.span,
            help="leave `hover` out, and give the team an `altitude`",
        )
        del values["hover"]
    points = _points(context, places) if places is not None else (None,) * count
    return tuple(ir.Pad(point, flight.span, **values) for point in points)


def _value(context: Context, name: str, setting: ast.Setting) -> float:
    """NaN once it is reported."""
    figure = ir.PAD_FIGURES[name]
    relation(context, setting, figure.relation)
    return number(context, setting.high, figure.dimension, f"the `{name}`", above=0)


def _points(context: Context, places: tuple[ir.Place, ...]) -> tuple[ir.Vector, ...]:
    """The places in the plane; one above the floor is reported, once where they share their words."""
    points, told = [], set()
    for place in places:
        assert isinstance(place, ir.Exactly)
        if len(place.point) == 3 and place.point[2] > FLOOR and place.span not in told:
            told.add(place.span)
            context.report(
                code.VALUE_OUT_OF_RANGE,
                f"a pad is on the floor, and this one is at a height of {shown(place.point[2])} m",
                place.span,
                help="give it the height 0; how high the agents rise is said by `hover`",
            )
        points.append(place.point[:2])
    return tuple(points)
