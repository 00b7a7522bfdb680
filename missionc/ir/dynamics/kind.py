"""Dynamics as facts: bounds and properties that every kind provides, independent of its equations.

A kind is a frozen value in its own file. No caller tests for a kind: ``world.dynamics`` and all others read these
facts.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from missionc.base.late_dataclass import Record
from missionc.base.units import Dimension


class Limit(Record):
    """An upper bound that a mission sets: ``acceleration <= 3 m/s^2``.

    ``setting`` is the word and the name of the field; ``name`` is for messages. ``default`` is the bound if the mission
    gives none; None if the mission must give one.
    """

    setting: str
    dimension: Dimension
    name: str
    default: float | None = None


@dataclass(frozen=True, slots=True)
class Dynamics(ABC):
    """Capabilities of an agent within one step, in SI units."""

    word: ClassVar[str]
    """Word in missions."""
    limits: ClassVar[tuple[Limit, ...]] = ()
    """Limits other than the speed, which every kind has."""
    may_be_restless: ClassVar[bool] = False
    """True if a mission may set a lowest speed above 0."""
    has_momentum: ClassVar[bool] = False
    """True if the velocity is a state and the acceleration is constant within a step; else the velocity may jump."""
    faces_ahead: ClassVar[bool] = False
    """True if the heading is a state: the agent moves in the direction that it faces."""

    rules: ClassVar[tuple[str, ...]] = ()
    """Names of the margins of ``step_margins``; only backends of extensions plan with them."""

    @classmethod
    @abstractmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> Dynamics:
        """Create the value with these speeds, m/s, and these ``limits`` in their order."""

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
        """The largest acceleration, m/s²; infinite if the velocity may jump."""
        return math.inf

    @property
    def top_turn(self) -> float:
        """The largest change of heading between steps, rad/s; infinite without a bound."""
        return math.inf

    def step_margins(self, position: Any, heading: Any, step: float) -> Mapping[str, tuple[Any, str]]:
        """Margins of ``rules`` that the other facts do not state, by name, each with its unit.

        Args:
            position: one agent's positions, (steps + 1, dim), metres; ``heading`` (steps + 1,), rad.
            step: seconds.

        Returns:
            arrays with one number per step, or per pair of steps; at least 0 if the motion is possible.
        """
        return {}

    @abstractmethod
    def at_most(self, speed: float, acceleration: float) -> Dynamics:
        """The same dynamics with these limits (m/s, m/s²); unchanged if the agent cannot move so slowly."""
