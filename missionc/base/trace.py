"""Joint motion as arrays: what a backend returns, a trace file holds, the monitor judges and the emitters write."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missionc.base.notebook import (
    paths,
    picture,
    preformatted,
    printed,
)
from missionc.base.units import Seconds

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

    def verdict(self, step: Seconds) -> str:
        """``violated   robustness -1.803  first at 2 s by drone[0]``; ``step`` is the mission's, seconds."""
        words = f"{'satisfied' if self.satisfied else 'violated '}  robustness {self.robustness:.3f}"
        if self.satisfied or self.step is None:
            return words
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"{words}  first at {self.step * step:g} s{by}"

    def violation(self, step: Seconds) -> str:
        """``violates relay, robustness -1.803, at 2 s by drone[0]``; ``step`` is the mission's, seconds."""
        much = f", robustness {self.robustness:.3f}," if math.isfinite(self.robustness) else ""
        when = "" if self.step is None else f" at {self.step * step:g} s"
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates {self.name}{much}{when}{by}"


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A verified joint plan, ready to be written; in a notebook everybody's path, and each requirement."""

    mission: str
    backend: str
    seed: int
    trace: Trace
    judgements: tuple[Judgement, ...]

    def __str__(self) -> str:
        agents, states, _ = self.trace.position.shape
        head = (
            f"{self.mission}: planned by {self.backend}, {agents} agent{'s' if agents > 1 else ''}, "
            f"{states - 1} step{'s' if states != 2 else ''} of {self.trace.step:g} s, seed {self.seed}"
        )
        return "\n".join([head, *judgement_lines(self.judgements, self.trace.step)])

    _repr_pretty_ = printed

    def _repr_html_(self) -> str:
        return picture(paths(self.trace.position.tolist())) + preformatted(str(self))


def judgement_lines(judgements: tuple[Judgement, ...], step: Seconds) -> list[str]:
    """One line for each requirement: its name, verdict and robustness, in columns."""
    width = max((len(each.name) for each in judgements), default=0)
    return [f"  {each.name:<{width}}  {each.verdict(step)}" for each in judgements]
