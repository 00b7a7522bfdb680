"""Disturbances of simulated flights as parameters of functions, with the words of their flags."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from missionc.flight.simulation.trial_bounds import AMOUNTS
from missionc.tools.api.described import Entry, known

WORDS = {each.flag.strip("-").replace("-", "_"): each for each in AMOUNTS}
"""Each disturbance by the word of its flag."""

DISTURBANCES = (
    Entry("wind", 0.0, "Mean wind, m/s; or a pair of it and of the gusts."),
    *(Entry(word, 0.0, f"{each.says} ({each.unit.lower()})") for word, each in WORDS.items()),
    Entry("lose", {}, "Agents whose motors stop, and the second at which each does."),
)


def amounts_of(function: str, given: Mapping[str, Any]) -> tuple[dict[str, float], tuple[tuple[str, float], ...]]:
    """The amounts of a ``Disturbance`` by its fields' names; and the agents that are lost, with the second.

    Raises:
        TypeError: there is no such disturbance.
        ValueError: an amount is out of its range.
    """
    known(function, given, [each.name for each in DISTURBANCES])
    wind = given.get("wind", 0.0)
    mean, gust = wind if isinstance(wind, tuple) else (wind, 0.0)
    amounts = {"wind": mean, "gust": gust}
    for word, each in WORDS.items():
        if not 0 <= given.get(word, 0.0) <= each.most:
            raise ValueError(f"`{word}` is a number from 0 to {each.most:g}, not {given[word]!r}")
        amounts[each.field] = each.of(given.get(word, 0.0))
    return amounts, tuple(dict(given.get("lose", {})).items())
