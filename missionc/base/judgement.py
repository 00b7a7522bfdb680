"""The verdict of a monitor, as a value and in words."""

from __future__ import annotations

import math

from missionc.base.figures import decimals
from missionc.base.late_dataclass import Record
from missionc.base.units import Seconds


class Judgement(Record):
    """Verdict of the monitor for one requirement, at step 0.

    ``robustness`` is in metres for spatial formulas; ``satisfied`` is the Boolean semantics, which its sign never
    contradicts. ``step`` and ``agents`` are those of the first failure of a violated requirement. ``unit`` is that of
    the robustness: ``m``, ``m/s`` if only speeds are compared, empty if it may be either.
    """

    name: str
    satisfied: bool
    robustness: float
    step: int | None = None
    agents: tuple[str, ...] = ()
    unit: str = "m"

    @property
    def short(self) -> str:
        """Violation of a failed requirement as text: ``0.345 m/s``."""
        return f"{max(-self.robustness, 0.0):.3g} {self.unit}".rstrip()

    def as_verdict(self) -> dict[str, object]:
        """JSON record of the verdict, with null for an infinite robustness."""
        return {
            "name": self.name,
            "satisfied": self.satisfied,
            "robustness": self.robustness if math.isfinite(self.robustness) else None,
        }

    def as_record(self) -> dict[str, object]:
        """JSON record of the verdict, with its first failure."""
        return {**self.as_verdict(), "step": self.step, "agents": list(self.agents)}

    def verdict(self, step: Seconds) -> str:
        """Verdict as text: ``violated robustness -1.803 first at 2 s by drone[0]``; ``step`` is in seconds."""
        words = f"{'satisfied' if self.satisfied else 'violated '}  robustness {decimals(self.robustness)}"
        if self.satisfied or self.step is None:
            return words
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"{words}  first at {self.step * step:g} s{by}"

    def violation(self, step: Seconds) -> str:
        """Violation as text: ``violates `relay` by 1.8 m, at 2 s by drone[0]``; ``step`` is in seconds."""
        much = f" by {self.short}" if math.isfinite(self.robustness) else ""
        when = "" if self.step is None else f" at {self.step * step:g} s"
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates `{self.name}`{much}" + (f",{when}{by}" if when or by else "")


class Judgements(Record):
    """Verdicts of the monitor for all goals."""

    requirements: tuple[Judgement, ...]
    preferences: tuple[Judgement, ...]


def judgement_lines(judgements: tuple[Judgement, ...], step: Seconds) -> list[str]:
    """One line for each requirement: its name, verdict and robustness, in columns."""
    width = max((len(each.name) for each in judgements), default=0)
    return [f"  {each.name:<{width}}  {each.verdict(step)}" for each in judgements]
