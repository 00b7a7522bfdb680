"""Dynamics as facts: the bounds and the properties that every kind of dynamics answers, whatever its equations.

A kind is a frozen value in a file of its own. Nothing asks which kind an agent has: ``world.dynamics`` and all
others ask these facts.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from missionc.base.units import Dimension


@dataclass(frozen=True, slots=True)
class Limit:
    """An upper bound that a mission sets: ``acceleration <= 3 m/s^2``.

    ``setting`` is the word, and the field of the value; ``name`` says it in a message; ``default`` is the bound
    where the mission gives none, None where it has to.
    """

    setting: str
    dimension: Dimension
    name: str
    default: float | None = None


@dataclass(frozen=True, slots=True)
class Dynamics(ABC):
    """What an agent can do within one step, in SI units."""

    word: ClassVar[str]
    """As missions write it."""
    limits: ClassVar[tuple[Limit, ...]] = ()
    """Beside that of the speed, which every kind has."""
    may_be_restless: ClassVar[bool] = False
    """Whether a mission may give a lowest speed above 0."""
    has_momentum: ClassVar[bool] = False
    """The velocity is a state, and the acceleration is constant within a step; else the velocity is, and may jump."""
    faces_ahead: ClassVar[bool] = False
    """The heading is a state: the agent moves where it faces."""

    rules: ClassVar[tuple[str, ...]] = ()
    """Names of the margins of ``step_margins``; only a backend of an extension plans by them."""

    @classmethod
    @abstractmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> Dynamics:
        """The value with these speeds, m/s, and these ``limits`` in their order."""

    @property
    @abstractmethod
    def top_speed(self) -> float:
        """The largest speed, m/s."""

    @property
    def lowest_speed(self) -> float:
        """The least speed of a motion, m/s; above 0 the agent cannot wait."""
        return 0.0

    @property
    def top_acceleration(self) -> float:
        """The largest acceleration, m/s²; infinite where the velocity may jump."""
        return math.inf

    @property
    def top_turn(self) -> float:
        """The largest change of heading from one step to the next, rad for each second; infinite where nothing bounds
        it."""
        return math.inf

    def step_margins(self, position: Any, heading: Any, step: float) -> Mapping[str, tuple[Any, str]]:
        """Margins of ``rules`` that the facts above do not state, by their names, each with its unit.

        Args:
            position: of one agent, (steps + 1, dim), metres; ``heading`` (steps + 1,), rad.
            step: seconds.

        Returns:
            arrays of one number for each step, or each pair of steps: at least 0 where the motion is possible.
        """
        return {}

    @abstractmethod
    def at_most(self, speed: float, acceleration: float) -> Dynamics:
        """The same, no faster than this (m/s, m/s²); as it is where it cannot go so slowly."""
