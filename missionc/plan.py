"""Joint motion as arrays: what a backend returns, a trace file holds, the monitor judges and the emitters write."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missionc.units import Seconds

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Every agent's state at every step, agents in mission order, steps 0 … last.

    Args:
        step: time between two states, seconds.
        position: (agents, steps + 1, dim), metres.
        velocity: (agents, steps + 1, dim), m/s. For first-order dynamics the
            constant velocity of the motion that starts at the step (at the
            last step, of the motion that ended there); for second order the
            velocity at the step.
        heading: (agents, steps + 1), rad: where the agent faces when the
            motion that starts at the step begins.

    Between two steps a first-order agent moves straight at constant velocity;
    a ``DoubleIntegrator`` has constant acceleration.
    """

    step: Seconds
    position: Array
    velocity: Array
    heading: Array


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the monitor found for one requirement, at step 0.

    ``robustness`` is in metres for everything spatial; ``satisfied`` is the
    Boolean semantics, which its sign never contradicts. ``step`` and
    ``agents`` say where a violated requirement first fails.
    """

    name: str
    satisfied: bool
    robustness: float
    step: int | None = None
    agents: tuple[str, ...] = ()

    def as_verdict(self) -> dict[str, object]:
        """For JSON, which has no word for the robustness of what is true, or false, whatever happens: null."""
        return {
            "name": self.name,
            "satisfied": self.satisfied,
            "robustness": self.robustness if math.isfinite(self.robustness) else None,
        }

    def as_record(self) -> dict[str, object]:
        """The verdict, and where it first fails."""
        return {**self.as_verdict(), "step": self.step, "agents": list(self.agents)}

    def violation(self, step: Seconds) -> str:
        """``violates relay, robustness -1.803, at 2 s by drone[0]``; ``step`` is the mission's, seconds."""
        much = f", robustness {self.robustness:.3f}," if math.isfinite(self.robustness) else ""
        when = "" if self.step is None else f" at {self.step * step:g} s"
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates {self.name}{much}{when}{by}"


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A verified joint plan, ready to be written."""

    mission: str
    backend: str
    seed: int
    trace: Trace
    judgements: tuple[Judgement, ...]
