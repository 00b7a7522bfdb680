"""Constraints that a mission implies besides its requirements: their verdicts on a recorded flight, with wording."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict

from missionc.base.late_dataclass import Record
from missionc.base.trace import counted, decimals

MOST_SHOWN = 20
"""Maximum number of violated constraints in the text output; the JSON output lists all of them."""


class Constraint(Record):
    """Verdict on one implied constraint of a recorded flight, at the time of its smallest margin.

    Args:
        name: ``separation``, ``clearance``, ``speed``, …
        satisfied: None if the samples do not decide the constraint.
        margin: allowed minus measured value, in ``unit``; the constraint is satisfied down to ``-tolerance``.
        time: time of the smallest margin, seconds; ``step`` is the last step at or before that time.
        agents: names of the constrained agent, or of the two agents of a separation.
        position: positions of the agents at ``time``, metres.
        obstacle: name of the obstacle of a clearance; empty otherwise.
        since: time of the first violation, seconds; None without a violation.
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
        """Name of the constraint with its agents and its obstacle, as text: ``clearance of `bot[0]` to `wall` ``."""
        names = " and ".join(f"`{name}`" for name in self.agents)
        return f"{self.name} of {names}{f' to `{self.obstacle}`' if self.obstacle else ''}"

    def violation(self) -> str:
        """Description of the violation: ``separation of `bot[0]` and `bot[1]` by 1.100 m at 2 s, at (5, 1) and (5,
        1)``."""
        places = " and ".join(f"({', '.join(f'{axis:.4g}' for axis in place)})" for place in self.position)
        time, since = f"{self.time:.4g}", f"{self.time if self.since is None else self.since:.4g}"
        begin = "" if since == time else f", since {since} s"
        return f"{self.subject} by {decimals(-self.margin)} {self.unit} at {time} s, at {places}{begin}"

    def shown_margin(self) -> str:
        """Name and margin as text: ``separation 0.120 m``, or ``separation within 0.05 m`` for a margin between
        -tolerance and 0."""
        within = self.margin < 0 and self.tolerance > 0.5e-3
        return f"{self.name} {f'within {self.tolerance:g}' if within else decimals(max(self.margin, 0.0))} {self.unit}"


class NotJudged(Record):
    """Constraints that a recording gives no data for: their names, their agents (empty: all agents) and the reason."""

    names: tuple[str, ...]
    agents: tuple[str, ...]
    reason: str

    def __str__(self) -> str:
        of = f" of {', '.join(f'`{name}`' for name in self.agents)}" if self.agents else ""
        return f"{', '.join(self.names)}{of}: {self.reason}"


def all_satisfied(constraints: Iterable[Constraint]) -> bool | None:
    """Return true if all constraints are satisfied, false if one is violated, and None if at best one is undecided."""
    verdicts = {each.satisfied for each in constraints}
    return False if False in verdicts else None if None in verdicts else True


def constraint_lines(constraints: Sequence[Constraint], not_judged: Iterable[NotJudged]) -> list[str]:
    """Text lines about constraints: one with the margins of all satisfied constraints, one for each violated or
    undecided constraint, and one for the constraints that were not evaluated."""
    margins = [each.shown_margin() for each in constraints if each.satisfied]
    return [
        *([f"constraint margins: {', '.join(margins)}"] if margins else []),
        *_some([f"violated: {each.violation()}" for each in constraints if each.satisfied is False]),
        *(f"not decided: {each.subject} at {each.time:.4g} s" for each in constraints if each.satisfied is None),
        *(f"not judged: {each}" for each in not_judged),
    ]


def constraint_records(constraints: Iterable[Constraint], not_judged: Iterable[NotJudged]) -> dict[str, object]:
    """JSON record with the verdicts (``constraints``) and the constraints without data (``not_judged``)."""
    return {
        "constraints": [{**asdict(each), "obstacle": each.obstacle or None} for each in constraints],
        "not_judged": [asdict(each) for each in not_judged],
    }


def _some(lines: Sequence[str]) -> Iterable[str]:
    left = len(lines) - MOST_SHOWN
    return lines if left <= 0 else [*lines[:MOST_SHOWN], f"{counted(left, 'more violated constraint')}; JSON has all"]
