"""Functions that build parts of a mission: predicates, states, distances, headings, extremes and shapes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import cast

from missionc.frontend.builder.call_site import call_site
from missionc.frontend.builder.parts import (
    Agents,
    Formula,
    Part,
    PointLike,
    Quantity,
    QuantityLike,
    Range,
    Shape,
    agents,
    name_of,
    point,
    quantity,
)
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.tokens import STATES
from missionc.ir.language.predicates import PREDICATES


def _predicate(name: str) -> Callable[..., Formula]:
    """Function that builds a predicate of the language, written as its name with arguments in brackets."""

    def called(*arguments: Part | QuantityLike) -> Formula:
        nodes = tuple(each.node if isinstance(each, Part) else quantity(each).node for each in arguments)
        return Formula(ast.Call(call_site(), ast.Name(call_site(), name), nodes))

    predicate = next(each for each in PREDICATES if each.name == name)
    called.__doc__ = f"{predicate.says}. In the language: ``{predicate.example}``."
    return called


inside = _predicate("inside")
"""Predicate ``inside(field)``: the agent's body lies in the region."""
touches = _predicate("touches")
"""Predicate ``touches(field)``: the agent's body touches the region."""
connected = _predicate("connected")
"""Predicate that agents are connected in a graph: ``connected(radio)``, ``connected(radio, east, 2)``."""


class _States:
    """States of an agent for comparisons, such as ``state.speed <= 1``.

    The states are ``x``, ``y``, ``z``, ``speed`` and ``altitude``.
    """

    def __getattr__(self, word: str) -> Quantity:
        if word not in STATES:
            raise AttributeError(f"unknown state `{word}`; use one of {', '.join(sorted(STATES))}")
        return Quantity(ast.Name(call_site(), word))

    def __dir__(self) -> Iterator[str]:
        return iter(sorted(STATES))


state = _States()


def distance(*ends: Part | str) -> Quantity:
    """Distance in metres from an agent to a region's border, a beacon or an agent, or between two agents."""
    nodes = tuple(each.node if isinstance(each, Agents) else _end(each) for each in ends)
    return Quantity(ast.Distance(call_site(), nodes))


def _end(value: Part | str) -> ast.Name | ast.Member:
    return cast("ast.Name | ast.Member", agents(value).node if isinstance(value, str) else name_of(value))


def heading(within: QuantityLike, of: QuantityLike | Part) -> Formula:
    """Formula that is true of an agent if its heading is close to a direction, or to the direction of a beacon.

    Args:
        within: largest difference to either side, rad or a text such as ``"10 deg"`` (in the language ``heading within
            10 deg of mast``).
        of: direction, counterclockwise from the x axis, in the same form; or a beacon.
    """
    towards = of.node if isinstance(of, Part) else quantity(of).node
    return Formula(ast.Facing(call_site(), quantity(within).node, towards))


def minimum(*values: QuantityLike) -> Quantity:
    """Minimum of several quantities: ``min(a, b)``."""
    return _extreme("min", values)


def maximum(*values: QuantityLike) -> Quantity:
    """Maximum of several quantities: ``max(a, b)``."""
    return _extreme("max", values)


def _extreme(word: str, values: tuple[QuantityLike, ...]) -> Quantity:
    parts = tuple(map(quantity, values))
    if not parts:
        raise TypeError("expected at least one quantity")
    return Quantity(ast.Extreme(call_site(), word, tuple(each.node for each in parts)), *parts)


# --------------------------------------------------------------------- shapes


def _height(height: Range | None) -> ast.Height | None:
    return None if height is None else ast.Height(call_site(), quantity(height[0]).node, quantity(height[1]).node)


def box(low: PointLike, high: PointLike, height: Range | None = None) -> Shape:
    """Box between two opposite corners, metres.

    Args:
        height: lowest and highest altitude, metres, for corners with two coordinates in a three-dimensional mission.
    """
    return Shape(ast.Box(call_site(), point(low), point(high), _height(height)))


def disc(centre: PointLike, radius: QuantityLike, height: Range | None = None) -> Shape:
    """Disc in the plane; in three dimensions the vertical cylinder over it.

    Args:
        centre: centre, metres.
        radius: radius, metres.
        height: lowest and highest altitude, metres, in a three-dimensional mission.
    """
    return Shape(ast.Disc(call_site(), point(centre), quantity(radius).node, _height(height)))


def ball(centre: PointLike, radius: QuantityLike) -> Shape:
    """Ball in a three-dimensional mission, metres."""
    return Shape(ast.Ball(call_site(), point(centre), quantity(radius).node))


def cylinder(centre: PointLike, radius: QuantityLike, height: Range) -> Shape:
    """Upright cylinder in a three-dimensional mission, metres.

    Args:
        height: lowest and highest altitude, metres.
    """
    lowest, highest = height
    heights = ast.Height(call_site(), quantity(lowest).node, quantity(highest).node)
    return Shape(ast.Cylinder(call_site(), point(centre), quantity(radius).node, heights))


def polygon(*corners: PointLike, height: Range | None = None) -> Shape:
    """Simple polygon with its corners in either order, or in three dimensions the prism over it, metres.

    Args:
        height: lowest and highest altitude, metres, in a three-dimensional mission.
    """
    return Shape(ast.Polygon(call_site(), tuple(map(point, corners)), _height(height)))
