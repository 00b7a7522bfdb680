"""Items of teams: dynamics, starts, finishes, vehicles, flights and yaw, built from Python values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Required, TypeAlias, TypedDict, cast

from missionc.frontend.builder import parts
from missionc.frontend.builder.parts import QuantityLike
from missionc.frontend.syntax import ast, show_tree
from missionc.ir import FIGURES, PAD_FIGURES

Setting: TypeAlias = "QuantityLike | parts.Range"
"""Value of a setting, or a pair of its lowest and highest value."""
Places: TypeAlias = "parts.Part | str | Iterable[parts.PointLike]"
"""Start or finish of a team: a region, a point for each agent, or a text."""
VehicleLike: TypeAlias = "str | tuple[str, Mapping[str, Setting]]"
"""Vehicle of a team: the name of a profile, or a pair of a name and changed parameters."""
FlightLike: TypeAlias = "bool | str | Mapping[str, Any]"
"""Takeoff and landing of a team: True, or the parameters of both."""


class TeamItems(TypedDict, total=False):
    """Items of a team, as described in ``Mission.team``."""

    dynamics: Required[str]
    start: Required[Places]
    finish: Places
    radius: QuantityLike
    altitude: QuantityLike
    vehicle: VehicleLike
    flight: FlightLike
    yaw: QuantityLike


def _dynamics(word: str) -> Callable[..., str]:
    """Function for a kind of dynamics, whose keyword arguments are upper bounds of limits, or pairs of bounds."""
    return lambda **limits: f"{word}({', '.join(_settings(limits, '<='))})"


single_integrator = _dynamics("single_integrator")
"""Text of the dynamics ``single_integrator(speed=1)``, m/s."""
double_integrator = _dynamics("double_integrator")
"""Text of the dynamics ``double_integrator(speed=1, acceleration=2)``, m/s and m/s²."""
unicycle = _dynamics("unicycle")
"""Text of the dynamics ``unicycle(speed=(0, 2), turn="90 deg/s")``."""


def team_items(items: Mapping[str, Any]) -> tuple[ast.TeamItem, ...]:
    """Syntax tree nodes for the items of a team that have a value.

    Raises:
        TypeError: an item is unknown, or dynamics or start are missing.
        ValueError: a text is not an item.
    """
    unknown = [word for word in items if word not in _TEXTS]
    missing = [word for word in ("dynamics", "start") if word not in items]
    if unknown or missing:
        raise TypeError(f"a team has {'no' if unknown else 'to have'} `{(unknown or missing)[0]}`")
    given = {word: value for word, value in items.items() if value is not None and value is not False}
    texts = [f"{word} {text(given[word])}" for word, text in _TEXTS.items() if word in given]
    return cast(ast.Team, parts.read_text("agent _ {{ {} }}", "  ".join(texts))).items


def _places(value: Places) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, parts.Part):
        return f"in {show_tree.named(parts.name_of(value))}"
    return f"at {show_tree.points(parts.points(value))}"


def _vehicle(value: VehicleLike) -> str:
    return value if isinstance(value, str) else f"{value[0]} {{ {'  '.join(_settings(value[1]))} }}"


def _flight(value: FlightLike) -> str:
    if not isinstance(value, Mapping):
        return value if isinstance(value, str) else ""
    pads = [f"pads {_places(value['pads'])}"] if "pads" in value else []
    settings = _settings({word: each for word, each in value.items() if word != "pads"})
    return f"{{ {'  '.join([*pads, *settings])} }}"


def _yaw(value: QuantityLike) -> str:
    if isinstance(value, str):
        return value
    node = parts.quantity(value).node
    return show_tree.item_text(ast.Yaw(node.span, node)).partition(" ")[2]


def _settings(values: Mapping[str, Setting], relation: str = "") -> list[str]:
    """Texts of settings given by keyword.

    Args:
        relation: relation sign, such as ``<=``, for keywords without an entry in the tables of parameters.
    """
    texts = []
    for word, value in values.items():
        figure = FIGURES.get(word) or PAD_FIGURES.get(word)
        own = relation or (figure.relation if figure and figure.relation != ".." else "")
        sides = value if isinstance(value, tuple) else (value,)
        texts.append(f"{word} {'' if len(sides) > 1 else own} {'..'.join(map(parts.tight, sides))}")
    return texts


_TEXTS: dict[str, Callable[[Any], str]] = {
    "radius": parts.tight,
    "altitude": parts.tight,
    "dynamics": str,
    "start": _places,
    "finish": _places,
    "vehicle": _vehicle,
    "flight": _flight,
    "yaw": _yaw,
}
"""Function that prints the value of each item, in the order in which items are printed."""
