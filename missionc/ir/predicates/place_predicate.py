"""Predicates of extensions about an agent's position: a base class with wording, margin and slope."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

from missionc.base.units import Dimension
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words

UNITS = {Dimension.NUMBER: "", Dimension.LENGTH: " m", Dimension.TIME: " s", Dimension.SPEED: " m/s"}
"""Unit after a number of each dimension."""

PARAMETERS = ("region", "beacon", *(each.value for each in UNITS), Dimension.ANGLE.value)
"""Kinds of parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacePredicate(PredicateFacts):
    """Proposition about the position of one agent, written ``name(argument, …)``.

    A subclass is a frozen data class with one field for each of its ``parameters``, in their order: a ``Region``, a
    ``Beacon``, or a number in SI units. If its construction raises ``Unfit``, the compiler reports a finding.

    Args:
        eased: outward move of the boundary of its truth, metres.
    """

    parameters: ClassVar[tuple[str, ...]] = ()
    """Kind of each argument, one of ``PARAMETERS``."""
    says: ClassVar[str]
    """Meaning, as a clause about an agent: ``the agent is …``."""
    example: ClassVar[str]
    """The predicate as in a mission."""
    slope: ClassVar[float] = 1.0
    """Lipschitz constant of ``value``: its greatest change for each metre of the agent's motion."""

    eased: float = 0.0

    def value(self, xp: Any, place: Array) -> Array:
        """Value at positions, (..., dim), metres -> (...): at least 0 if the predicate is true.

        Args:
            xp: array library: numpy, torch, or one for plain numbers. Each has ``abs``, ``maximum``,
                ``minimum``, ``sqrt``, ``where`` and ``clip``; ``place[..., 0]`` is the x coordinate.
        """
        raise NotImplementedError

    def margin(self, view: Measures) -> Array:
        """Value over the slope plus ``eased``: (...), metres."""
        return view.of_place(lambda xp, place: self.value(xp, place) / self.slope) + self.eased

    def rate(self, view: Changes) -> Array:
        """Bound on the rate of change of the margin: (...), m/s."""
        return view.motion()

    def moved(self, borders: Borders) -> Self:
        return replace(self, eased=self.eased + borders.metres)

    @property
    def arguments(self) -> tuple[Region | Beacon | float, ...]:
        """The arguments, in the order of the parameters."""
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


def _shown(kind: str, argument: Region | Beacon | float, words: Words) -> str:
    if isinstance(argument, Region | Beacon):
        return argument.name
    dimension = Dimension(kind)
    return words.angle(argument) if dimension is Dimension.ANGLE else f"{argument:g}{UNITS[dimension]}"
