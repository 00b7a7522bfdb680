"""The judgement of a monitor, as a value and in words."""

from __future__ import annotations

import math

from missionc.base.figures import decimals
from missionc.base.late_dataclass import dataclass
from missionc.base.units import Seconds


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the monitor found for one requirement, at step 0.

    ``robustness`` is in metres for everything spatial; ``satisfied`` is the
    Boolean semantics, which its sign never contradicts. ``step`` and
    ``agents`` say where a violated requirement first fails. ``unit`` is that
    of the robustness: ``m``, ``m/s`` where only speeds are compared, nothing
    where it may be either.
    """

    name: str
    satisfied: bool
    robustness: float
    step: int | None = None
    agents: tuple[str, ...] = ()
    unit: str = "m"

    @property
    def short(self) -> str:
        """By how much a violated one fails: ``0.345 m/s``."""
        return f"{max(-self.robustness, 0.0):.3g} {self.unit}".rstrip()

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
        words = f"{'satisfied' if self.satisfied else 'violated '}  robustness {decimals(self.robustness)}"
        if self.satisfied or self.step is None:
            return words
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"{words}  first at {self.step * step:g} s{by}"

    def violation(self, step: Seconds) -> str:
        """``misses `relay` by 1.8 m, at 2 s by drone[0]``; ``step`` is the mission's, seconds."""
        much = f" by {self.short}" if math.isfinite(self.robustness) else ""
        when = "" if self.step is None else f" at {self.step * step:g} s"
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates `{self.name}`{much}" + (f",{when}{by}" if when or by else "")


@dataclass(frozen=True, slots=True)
class Judgements:
    """What the monitor found for every goal."""

    requirements: tuple[Judgement, ...]
    preferences: tuple[Judgement, ...]


def judgement_lines(judgements: tuple[Judgement, ...], step: Seconds) -> list[str]:
    """One line for each requirement: its name, verdict and robustness, in columns."""
    width = max((len(each.name) for each in judgements), default=0)
    return [f"  {each.name:<{width}}  {each.verdict(step)}" for each in judgements]
