"""Verdicts of the monitor on requirements, as values and as text."""

from __future__ import annotations

import math

from missionc.base.figures import decimals
from missionc.base.late_dataclass import Record
from missionc.base.units import Seconds


class Judgement(Record):
    """Verdict of the monitor on one requirement, evaluated at step 0.

    Args:
        satisfied: Boolean semantics; the sign of ``robustness`` never contradicts it.
        robustness: quantitative semantics, in ``unit``.
        step: step of the first failure of a violated requirement; None otherwise.
        agents: names of the agents of the first failure.
        unit: ``m``; ``m/s`` if only speeds are compared; empty if both occur.
    """

    name: str
    satisfied: bool
    robustness: float
    step: int | None = None
    agents: tuple[str, ...] = ()
    unit: str = "m"

    @property
    def short(self) -> str:
        """Robustness deficit of a violated requirement as text, ``0.345 m/s``."""
        return f"{max(-self.robustness, 0.0):.3g} {self.unit}".rstrip()

    def as_verdict(self) -> dict[str, object]:
        """JSON record of the verdict: name, truth and robustness (null if infinite)."""
        return {
            "name": self.name,
            "satisfied": self.satisfied,
            "robustness": self.robustness if math.isfinite(self.robustness) else None,
        }

    def as_record(self) -> dict[str, object]:
        """JSON record of the verdict with the step and the agents of its first failure."""
        return {**self.as_verdict(), "step": self.step, "agents": list(self.agents)}

    def verdict(self, step: Seconds) -> str:
        """Verdict as text: ``violated robustness -1.803 first at 2 s by drone[0]``.

        Args:
            step: duration of a step, seconds.
        """
        words = f"{'satisfied' if self.satisfied else 'violated '}  robustness {decimals(self.robustness)}"
        if self.satisfied or self.step is None:
            return words
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"{words}  first at {self.step * step:g} s{by}"

    def violation(self, step: Seconds) -> str:
        """Violation as text: ``violates `relay` by 1.8 m, at 2 s by drone[0]``.

        Args:
            step: duration of a step, seconds.
        """
        much = f" by {self.short}" if math.isfinite(self.robustness) else ""
        when = "" if self.step is None else f" at {self.step * step:g} s"
        by = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates `{self.name}`{much}" + (f",{when}{by}" if when or by else "")


class Judgements(Record):
    """Verdicts of the monitor on all requirements and all preferences of a mission."""

    requirements: tuple[Judgement, ...]
    preferences: tuple[Judgement, ...]


def judgement_lines(judgements: tuple[Judgement, ...], step: Seconds) -> list[str]:
    """Text table with one line per requirement: name, verdict and robustness.

    Args:
        step: duration of a step, seconds.
    """
    width = max((len(each.name) for each in judgements), default=0)
    return [f"  {each.name:<{width}}  {each.verdict(step)}" for each in judgements]
