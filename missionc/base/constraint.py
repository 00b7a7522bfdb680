"""Constraints that a mission implies beside its requirements: verdicts on a recorded flight, and their words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict

from missionc.base.figures import counted, decimals
from missionc.base.late_dataclass import dataclass

MOST_SHOWN = 20
"""Violated constraints that text lists; JSON has all of them."""


@dataclass(frozen=True, slots=True)
class Constraint:
    """The verdict on one constraint, where its margin is smallest.

    Args:
        name: ``separation``, ``clearance``, ``speed``, …
        satisfied: None if the samples do not decide it.
        margin: allowed minus measured, in ``unit``; satisfied down to ``-tolerance``.
        time: seconds; ``step`` is the last step at or before it.
        agents: one, or the two of a separation; ``position`` has theirs at that time, metres.
        obstacle: of a clearance; empty otherwise.
        since: the time of the first violation, seconds; None without one.
    """

    name: str
    satisfied: bool | None
    margin: float
    unit: str
    tolerance: float
    time: float
    step: int
    agents: tuple[str, ...]
    position: tuple[tuple[float, ...], ...]
    obstacle: str = ""
    since: float | None = None

    @property
    def subject(self) -> str:
        """``clearance of `bot[0]` to `wall` ``"""
        names = " and ".join(f"`{name}`" for name in self.agents)
        return f"{self.name} of {names}{f' to `{self.obstacle}`' if self.obstacle else ''}"

    def violation(self) -> str:
        """``separation of `bot[0]` and `bot[1]` by 1.100 m at 2 s, at (5, 1) and (5, 1)``."""
        places = " and ".join(f"({', '.join(f'{axis:.4g}' for axis in place)})" for place in self.position)
        time, since = f"{self.time:.4g}", f"{self.time if self.since is None else self.since:.4g}"
        begin = "" if since == time else f", since {since} s"
        return f"{self.subject} by {decimals(-self.margin)} {self.unit} at {time} s, at {places}{begin}"

    def shown_margin(self) -> str:
        """``separation 0.120 m``; within a tolerance that counts, ``separation within 0.05 m``."""
        within = self.margin < 0 and self.tolerance > 0.5e-3
        return f"{self.name} {f'within {self.tolerance:g}' if within else decimals(max(self.margin, 0.0))} {self.unit}"


@dataclass(frozen=True, slots=True)
class NotJudged:
    """Constraints that a recording does not show, of which agents (none: of all), and why."""

    names: tuple[str, ...]
    agents: tuple[str, ...]
    reason: str

    def __str__(self) -> str:
        of = f" of {', '.join(f'`{name}`' for name in self.agents)}" if self.agents else ""
        return f"{', '.join(self.names)}{of}: {self.reason}"


def all_satisfied(constraints: Iterable[Constraint]) -> bool | None:
    """None if one is not decided, and none violated."""
    verdicts = {each.satisfied for each in constraints}
    return False if False in verdicts else None if None in verdicts else True


def constraint_lines(constraints: Sequence[Constraint], not_judged: Iterable[NotJudged]) -> list[str]:
    """One line for all that are satisfied, one for each that is violated or not decided, and what is not judged."""
    margins = [each.shown_margin() for each in constraints if each.satisfied]
    return [
        *([f"constraint margins: {', '.join(margins)}"] if margins else []),
        *_some([f"violated: {each.violation()}" for each in constraints if each.satisfied is False]),
        *(f"not decided: {each.subject} at {each.time:.4g} s" for each in constraints if each.satisfied is None),
        *(f"not judged: {each}" for each in not_judged),
    ]


def constraint_records(constraints: Iterable[Constraint], not_judged: Iterable[NotJudged]) -> dict[str, object]:
    """For JSON: ``constraints`` and ``not_judged``."""
    return {
        "constraints": [{**asdict(each), "obstacle": each.obstacle or None} for each in constraints],
        "not_judged": [asdict(each) for each in not_judged],
    }


def _some(lines: Sequence[str]) -> Iterable[str]:
    left = len(lines) - MOST_SHOWN
    return lines if left <= 0 else [*lines[:MOST_SHOWN], f"{counted(left, 'more violated constraint')}; JSON has all"]
