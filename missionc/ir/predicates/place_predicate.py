"""Predicates of other packages about where an agent is: a base class with their words, a margin and its slope."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

from missionc.base.units import Dimension
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words

UNITS = {Dimension.NUMBER: "", Dimension.LENGTH: " m", Dimension.TIME: " s", Dimension.SPEED: " m/s"}
"""The unit after a number of each dimension."""

PARAMETERS = ("region", "beacon", *(each.value for each in UNITS), Dimension.ANGLE.value)
"""The kinds of parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacePredicate(PredicateFacts):
    """A proposition about the place of one agent, written ``name(argument, …)``.

    A subclass is a frozen data class with one field for each of its ``parameters``, in their order: a ``Region``, a
    ``Beacon``, or a number in SI units. An ``Unfit`` that its construction raises is a finding.

    Args:
        eased: metres by which the border of its truth is moved outward.
    """

    parameters: ClassVar[tuple[str, ...]] = ()
    """The kind of each argument, one of ``PARAMETERS``."""
    says: ClassVar[str]
    """Its meaning, in a clause about an agent: ``the agent is …``."""
    example: ClassVar[str]
    """The predicate as a mission writes it."""
    slope: ClassVar[float] = 1.0
    """The Lipschitz constant of ``value``: it changes by at most this for each metre that the agent moves."""

    eased: float = 0.0

    def value(self, xp: Any, place: Array) -> Array:
        """The value at places, (..., dim) in metres -> (...): at least 0 where it is true.

        Args:
            xp: the library of the array: numpy, torch, or one of plain numbers. Every one has ``abs``, ``maximum``,
                ``minimum``, ``sqrt``, ``where`` and ``clip``; ``place[..., 0]`` is the x coordinate.
        """
        raise NotImplementedError

    def margin(self, view: Measures) -> Array:
        return view.of_place(lambda xp, place: self.value(xp, place) / self.slope) + self.eased

    def rate(self, view: Changes) -> Array:
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
