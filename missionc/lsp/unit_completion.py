"""Completion of units after a number."""

from __future__ import annotations

from collections.abc import Iterator

from missionc.base.units import UNITS, Dimension
from missionc.ir import FIGURES, PAD_FIGURES
from missionc.lsp.completion_context import Spot
from missionc.syntax.tokens import NUMBER, UNIT

MEASURES: dict[str, Dimension] = {name: figure.dimension for name, figure in (FIGURES | PAD_FIGURES).items()} | {
    **dict.fromkeys(("altitude", "spacing", "tolerance", "proximity", "beacons", "sight"), Dimension.LENGTH),
    **dict.fromkeys(("separation", "clearance", "distance"), Dimension.LENGTH),
    **dict.fromkeys(("step", "horizon", "delay"), Dimension.TIME),
    **dict.fromkeys(("yaw", "heading", "within"), Dimension.ANGLE),
    "turn": Dimension.TURN,
    **dict.fromkeys(("moving", "uncertain"), Dimension.SPEED),
    "hops": Dimension.NUMBER,
}
"""What a number after each of these words measures."""

BETWEEN = frozenset({NUMBER, UNIT, "..", "-", "<=", "<", ">=", ">", "=", "(", ")", ","})
"""What may stand between such a word and its number."""


def fitting_units(place: Spot) -> Iterator[tuple[str, str]]:
    """Each unit and what it measures; all of them where it cannot be told what is measured."""
    wanted = _measured(place)
    for unit, (dimension, _) in UNITS.items():
        if wanted is None or dimension in wanted:
            yield unit, f"unit of {dimension.value}"


def _measured(place: Spot) -> tuple[Dimension, ...] | None:
    opener = place.opener()
    if place.bracket == "{" and place.taken[0].word == "graph":
        weighs = any(token.text == "weight" for token in place.taken)
        return (Dimension.NUMBER if weighs else Dimension.LENGTH,)
    if place.before.word == "per":
        return Dimension.TIME, Dimension.LENGTH
    if place.bracket == "[" and opener is not None and opener.kind.startswith("TIME"):
        return Dimension.TIME, Dimension.STEPS
    if len(place.taken) > 1 and place.taken[-2].word == "every":
        return Dimension.TIME, Dimension.STEPS
    for token in reversed(place.taken):
        if token.kind in BETWEEN or (token.word == "of" and place.asks_heading):
            continue
        known = MEASURES.get(token.text)
        return None if known is None else (known,)
    return None
