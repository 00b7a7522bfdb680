"""Facts of dynamics: limits and properties that every kind provides, independent of its equations.

A kind of dynamics is a frozen value in its own file. ``geometry.dynamics`` and all other callers read these facts and
never test for a kind.

Single integrator: the velocity is constant within each step.

Double integrator: the acceleration is constant within each step.

Unicycle: speed and heading are constant within each step, and the agent moves along its heading.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from missionc.base.late_dataclass import Record
from missionc.base.units import Dimension


class Limit(Record):
    """Upper bound of the dynamics that a mission sets: ``acceleration <= 3 m/s^2``.

    ``setting`` is the word in missions and the name of the field; ``name`` is the name in messages. ``default`` applies
    if the mission sets no bound; None if the mission must set one.
    """

    setting: str
    dimension: Dimension
    name: str
    default: float | None = None


@dataclass(frozen=True, slots=True)
class Dynamics(ABC):
    """Dynamics of an agent: the motions that it can make within one step, in SI units."""

    word: ClassVar[str]
    """Name of the dynamics in missions."""
    limits: ClassVar[tuple[Limit, ...]] = ()
    """Limits of the dynamics besides the speed limits, which all dynamics have."""
    may_be_restless: ClassVar[bool] = False
    """True if a mission may set a minimum speed above 0."""
    has_momentum: ClassVar[bool] = False
    """True if the velocity is a state and the acceleration is constant within a step; if False, velocities may jump."""
    faces_ahead: ClassVar[bool] = False
    """True if the heading is a state and the agent moves along its heading."""

    rules: ClassVar[tuple[str, ...]] = ()
    """Names of the constraints that ``step_margins`` evaluates; only backends of extensions plan with them."""

    @classmethod
    @abstractmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> Dynamics:
        """Dynamics with the minimum and maximum speed, m/s, and the values of ``limits`` in their order."""

    @property
    @abstractmethod
    def top_speed(self) -> float:
        """Maximum speed, m/s."""

    @property
    def lowest_speed(self) -> float:
        """Minimum speed, m/s; an agent whose minimum is above 0 cannot wait."""
        return 0.0

    @property
    def top_acceleration(self) -> float:
        """Maximum acceleration, m/s²; infinite if the velocity may jump."""
        return math.inf

    @property
    def top_turn(self) -> float:
        """Maximum turning rate between steps, rad/s; infinite if not limited."""
        return math.inf

    def step_margins(self, position: Any, heading: Any, step: float) -> Mapping[str, tuple[Any, str]]:
        """Margins of the constraints in ``rules`` along one trajectory, by constraint name, each with its unit.

        Args:
            position: positions of one agent, (steps + 1, dim), metres.
            heading: headings of the agent, (steps + 1,), rad.
            step: duration of a step, seconds.

        Returns:
            arrays with one number per step, or per pair of consecutive steps; at least 0 if the motion is possible.
        """
        return {}

    @abstractmethod
    def at_most(self, speed: float, acceleration: float) -> Dynamics:
        """Dynamics with lower limits on speed (m/s) and acceleration (m/s²); unchanged if the agent cannot move that
        slowly."""


@dataclass(frozen=True, slots=True)
class SingleIntegrator(Dynamics):
    """Single-integrator dynamics: constant velocity within a step, up to ``speed`` m/s."""

    word: ClassVar[str] = "single_integrator"

    speed: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> SingleIntegrator:
        return cls(fastest)

    @property
    def top_speed(self) -> float:
        return self.speed

    def at_most(self, speed: float, acceleration: float) -> SingleIntegrator:
        return SingleIntegrator(min(self.speed, speed))


def of_first_order(speed: float) -> SingleIntegrator:
    """Single-integrator dynamics with only a maximum speed, m/s; used as a relaxation of other dynamics."""
    return SingleIntegrator(speed)


@dataclass(frozen=True, slots=True)
class DoubleIntegrator(Dynamics):
    """Double-integrator dynamics: constant acceleration within a step, up to ``acceleration`` m/s²; speed up to
    ``speed`` m/s."""

    word: ClassVar[str] = "double_integrator"
    limits: ClassVar[tuple[Limit, ...]] = (Limit("acceleration", Dimension.ACCELERATION, "the acceleration"),)
    has_momentum: ClassVar[bool] = True

    speed: float
    acceleration: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> DoubleIntegrator:
        return cls(fastest, *limits)

    @property
    def top_speed(self) -> float:
        return self.speed

    @property
    def top_acceleration(self) -> float:
        return self.acceleration

    def at_most(self, speed: float, acceleration: float) -> DoubleIntegrator:
        return DoubleIntegrator(min(self.speed, speed), min(self.acceleration, acceleration))


@dataclass(frozen=True, slots=True)
class Unicycle(Dynamics):
    """Unicycle dynamics: straight motion along the heading within a step, and turns in place between steps.

    The speed is between ``slowest`` and ``fastest`` m/s; the agent can wait only if ``slowest`` is 0. ``turn`` (rad/s)
    bounds the change of heading between steps; ``math.inf`` if the mission sets no bound.

    Source:
        [strel] Experiment Setup.
    """

    word: ClassVar[str] = "unicycle"
    limits: ClassVar[tuple[Limit, ...]] = (Limit("turn", Dimension.TURN, "the turning rate", math.inf),)
    may_be_restless: ClassVar[bool] = True
    faces_ahead: ClassVar[bool] = True

    slowest: float
    fastest: float
    turn: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> Unicycle:
        return cls(slowest, fastest, *limits)

    @property
    def lowest_speed(self) -> float:
        return self.slowest

    @property
    def top_speed(self) -> float:
        return self.fastest

    @property
    def top_turn(self) -> float:
        return self.turn

    def at_most(self, speed: float, acceleration: float) -> Unicycle:
        return replace(self, fastest=min(self.fastest, speed)) if self.slowest < speed else self
