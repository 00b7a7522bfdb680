"""Disturbances of simulated flights by the names of their flags, shared by Python and the command line."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from typing import Any

from missionc.compiler.described import Entry, known
from missionc.flight.simulation.trial_bounds import AMOUNTS, MOST_LOST, MOST_WIND

WORDS = {each.flag.strip("-").replace("-", "_"): each for each in AMOUNTS}
"""Disturbances by name: the command-line flag with ``_`` for ``-`` and without leading dashes."""

DISTURBANCES = (
    Entry("wind", 0.0, "Mean wind in m/s, or a pair of mean wind and gusts."),
    *(Entry(word, 0.0, f"{each.says} ({each.unit.lower()})") for word, each in WORDS.items()),
    Entry("lose", {}, "Agents whose motors stop, each with its time in seconds."),
)


def amounts_of(function: str, given: Mapping[str, Any]) -> tuple[dict[str, float], tuple[tuple[str, float], ...]]:
    """Parse disturbances that were given as keyword arguments.

    Args:
        function: name of the public function, for messages.
        given: keyword arguments by name; ``wind`` is one mean in m/s, or a mean with a gust.

    Returns:
        The amounts by field name of ``Disturbance``, and the lost agents, each with its time in seconds.

    Raises:
        TypeError: a disturbance is unknown.
        ValueError: an amount is out of its range, or an agent is lost twice.
    """
    known(function, given, [each.name for each in DISTURBANCES])
    wind = given.get("wind", 0.0)
    mean, gust = wind if isinstance(wind, tuple | list) and len(wind) == 2 else (wind, 0.0)
    amounts = {"wind": _amount("wind", mean, MOST_WIND), "gust": _amount("wind", gust, MOST_WIND)}
    for word, each in WORDS.items():
        amounts[each.field] = each.of(_amount(word, given.get(word, 0.0), each.most))
    lose = given.get("lose", {})
    listed = list(lose.items() if isinstance(lose, Mapping) else lose)
    if not all(isinstance(each, tuple | list) and len(each) == 2 and isinstance(each[0], str) for each in listed):
        raise ValueError(f"`lose` must give each agent a time in seconds, as in {{'drone[0]': 5}}, not {lose!r}")
    pairs = tuple((name, _amount("lose", second)) for name, second in listed)
    names = [name for name, _ in pairs]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"`{twice}` is lost more than once")
    if len(pairs) > MOST_LOST:
        raise ValueError(f"at most {MOST_LOST} agents can be lost")
    return amounts, pairs


def _amount(word: str, value: Any, most: float | None = None) -> float:
    number = isinstance(value, Real) and not isinstance(value, bool)
    if not number or not 0 <= value < float("inf") or (most is not None and value > most):
        within = "a time of at least 0 s" if most is None else f"a number from 0 to {most:g}"
        raise ValueError(f"`{word}` must be {within}, not {value!r}")
    return float(value)
