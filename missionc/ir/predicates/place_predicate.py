"""Base class for predicates of extensions about an agent's position: wording, margin and slope."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

from missionc.base.extensions import Kind, guard, rejected
from missionc.base.units import Dimension
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words

UNITS = {Dimension.NUMBER: "", Dimension.LENGTH: " m", Dimension.TIME: " s", Dimension.SPEED: " m/s"}
"""Text of the unit after a number, by dimension."""

PARAMETERS = ("region", "beacon", *(each.value for each in UNITS), Dimension.ANGLE.value)
"""Kinds of parameters that a predicate of an extension may have."""

SLACK, COARSE = 1e-6, 1e-3
"""Tolerated rounding error of values: a fraction of the value in 64-bit, and metres in 32-bit arithmetic."""

SAMPLE = 4
"""Number of positions of an array at which the value is computed twice, to check that it is deterministic."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacePredicate(PredicateFacts):
    """Predicate of an extension about the position of one agent, written ``name(argument, …)``.

    A subclass is a frozen data class with one field for each of its ``parameters``, in their order: a ``Region``, a
    ``Beacon``, or a number in SI units. If its constructor raises ``Unfit``, the compiler reports a finding.

    Args:
        eased: distance by which the boundary of truth is moved outward, metres.
    """

    parameters: ClassVar[tuple[str, ...]] = ()
    """Kind of each argument, one of ``PARAMETERS``."""
    says: ClassVar[str]
    """Meaning of the predicate as a clause about an agent: ``the agent is …``."""
    example: ClassVar[str]
    """Example of the predicate as missions write it."""
    slope: ClassVar[float]
    """Lipschitz constant of ``value``: its maximum change per metre that the agent moves."""

    eased: float = 0.0

    def value(self, xp: Any, place: Array) -> Array:
        """Value of the predicate at positions, (..., dim), metres -> (...): at least 0 if and only if the predicate is
        true.

        Args:
            xp: array library: numpy, torch, or one for plain numbers. Each has ``abs``, ``maximum``, ``minimum``,
                ``sqrt``, ``where`` and ``clip``; ``place[..., 0]`` is the x coordinate.
        """
        raise NotImplementedError

    def margin(self, view: Measures) -> Array:
        return view.of_place(self._margin) + self.eased

    def _margin(self, xp: Any, place: Array) -> Array:
        """Margin of the predicate at positions: (..., dim), metres -> (...), metres.

        Raises:
            ExtensionError: ``value`` failed, or its result is unusable.
        """
        with guard(Kind.PREDICATE, self.word), warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            value = self.value(xp, place)
            at_one = not hasattr(xp, "isfinite")  # one place in plain numbers
            value = value.item() if at_one and hasattr(value, "item") else value
            wrong = self._fault_at(xp, place, value) if at_one else self._fault(xp, place, value)
        if wrong:
            raise rejected(Kind.PREDICATE, self.word, wrong)
        return value / self.slope

    def _fault_at(self, xp: Any, place: Array, value: object) -> str:
        """Reason why the value at one position is unusable, as the predicate of a sentence; empty if it is usable."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"has a value that is no number: {_excerpt(value)}"
        if not math.isfinite(value) and all(map(math.isfinite, place)):
            return f"has the value {value} at {_written(place)}"
        return f"has two values at {_written(place)}" if self.value(xp, place) != value else ""

    def _fault(self, xp: Any, place: Array, value: Any) -> str:
        """Reason why the values at positions (..., dim) are unusable, as the predicate of a sentence; empty if they are
        usable."""
        if tuple(getattr(value, "shape", (-1,))) != tuple(place.shape[:-1]):
            shape = getattr(value, "shape", None)
            found = f"the shape {tuple(shape)}" if shape is not None else _excerpt(value)
            return f"has not one value for each place: {found} for places of the shape {tuple(place.shape)}"
        if not any(kind in str(value.dtype) for kind in ("float", "int")):
            return f"has values that are no numbers, but `{value.dtype}`"
        known = xp.isfinite(place).all(-1)
        places, values = place[known], value[known]
        finite = xp.isfinite(values)
        if not finite.all():
            return f"has the value {float(values[~finite][0])} at {_written(places[~finite][0].tolist())}"
        slack = COARSE if "32" in str(value.dtype) else SLACK
        same = xp.isclose(self.value(xp, places[:SAMPLE]), values[:SAMPLE], rtol=slack, atol=slack * self.slope)
        if not same.all():
            return f"has two values at {_written(places[:SAMPLE][~same][0].tolist())}"
        moved = ((places[1:] - places[:-1]) ** 2).sum(-1) ** 0.5
        change = abs(values[1:] - values[:-1])
        steep = change > self.slope * (moved * (1 + slack) + slack)
        if steep.any():
            first = f"has a value that changes by {float(change[steep][0]):g} over {float(moved[steep][0]):g} m"
            return f"{first}; its slope is {self.slope:g}"
        return ""

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the margin: (...), m/s."""
        return view.motion()

    def moved(self, borders: Borders) -> Self:
        return replace(self, eased=self.eased + borders.metres)

    @property
    def arguments(self) -> tuple[Region | Beacon | float, ...]:
        """Arguments of the predicate, in the order of its parameters."""
        return tuple(getattr(self, each.name) for each in fields(self) if not each.kw_only)

    @property
    def regions(self) -> tuple[Region, ...]:
        return tuple(each for each in self.arguments if isinstance(each, Region))

    @property
    def word(self) -> str:
        return self.example.partition("(")[0]

    def show(self, words: Words) -> str:
        shown = (_shown(kind, each, words) for kind, each in zip(self.parameters, self.arguments, strict=True))
        return f"{self.word}({', '.join(shown)})"

    def phrases(self, words: Phrases) -> tuple[str, str]:
        return f"satisfies `{self.show(words)}`", f"does not satisfy `{self.show(words)}`"


def _written(place: Any) -> str:
    return f"({', '.join(f'{each:g}' for each in place)})"


def _excerpt(value: object) -> str:
    return f"`{value!r:.40}`"


def _shown(kind: str, argument: Region | Beacon | float, words: Words) -> str:
    if isinstance(argument, Region | Beacon):
        return argument.name
    dimension = Dimension(kind)
    return words.angle(argument) if dimension is Dimension.ANGLE else f"{argument:g}{UNITS[dimension]}"
