"""The certificate of a plan: every check with its margin and tolerance, and informative quantities.

Each check states its numerical tolerance.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.base.trace import Judgement
from missionc.verification.proof.proof_boxes import Boxes

MOTION = 1e-6
"""Tolerance of states against the dynamics, and of exactly given positions: metres, m/s, m/s² or rad."""

CONTACT = 1e-9
"""Tolerance of distances between bodies, metres: contact is allowed, and rounding is not a violation."""

CERTAIN = 1e-5
"""Maximum gap, in metres, between the proved margin and the smallest margin found by evaluation."""

TUBE = 0.1
"""Tolerance of the distance between a polynomial and the verified plan, metres."""

WAYPOINT = 5e-3
"""Tolerance of a polynomial's position at the time of a step, metres, for evaluating the mission on the polynomial."""

ROUNDING = 1e-5
"""Bound on the reduction of a required distance by float32 rounding of a polynomial, metres."""

CLOCK = 1e-6
"""Tolerance of a duration, in seconds per second of the mission: durations are float32 numbers too."""


class Check(Record):
    """One check, with its distance from failure.

    ``margin`` is the slack in ``unit``: the allowed value minus the actual one. The check passes if it is at least
    ``-tolerance``, unless a witness refutes it (see ``detail``). ``at`` is the time of the smallest margin in seconds,
    and ``agents`` lists the agents concerned.
    """

    name: str
    subject: str
    margin: float
    unit: str
    tolerance: float
    passed: bool
    at: float | None = None
    agents: tuple[str, ...] = ()
    detail: str = ""


class Figure(Record):
    """An informative quantity of a plan, such as a peak speed, that no rule of the mission limits."""

    name: str
    subject: str
    value: float
    unit: str
    at: float | None = None
    agents: tuple[str, ...] = ()


class Verdict(Enum):
    """Continuous-time verdict on a requirement that is satisfied at the steps."""

    HOLDS = "holds throughout"
    FAILS = "fails between"
    UNDECIDED = "not decided"


class Between(Record):
    """Continuous-time result of one requirement that is satisfied at the steps.

    If the requirement does not hold in continuous time, ``at`` and ``until`` (seconds) bound the first deciding
    interval, ``agents`` lists the agents concerned, and ``detail`` is a sentence.
    """

    requirement: str
    verdict: Verdict
    at: float | None = None
    until: float | None = None
    agents: tuple[str, ...] = ()
    detail: str = ""

    @property
    def holds(self) -> bool:
        return self.verdict is Verdict.HOLDS

    @property
    def fails(self) -> bool:
        return self.verdict is Verdict.FAILS


class Delay(Record):
    """Delay tolerance of one agent: the longest late start with which the plan still satisfies the mission, others on
    time.

    ``tolerated`` is in seconds: with a delay of any number of steps up to that, every check passes. With one step more,
    the check ``breaks`` of ``subject`` fails at the time ``at``, by ``agents``. If ``breaks`` is empty, no failure was
    found up to the end of the mission, or with ``open`` up to the search limit.
    """

    agent: str
    tolerated: float
    open: bool = False
    breaks: str = ""
    subject: str = ""
    at: float | None = None
    agents: tuple[str, ...] = ()

    @property
    def broken(self) -> str:
        """Text for the check that one further step of delay breaks, such as ``the separation from `drone[1]` at 4 s``.

        The text is empty if no such check is known.
        """
        others = ", ".join(f"`{agent}`" for agent in self.agents if agent != self.agent)
        what = {
            "": "",
            "obstacle": f"the clearance to `{self.subject}`",
            "separation": f"the separation from {others}",
            "finish": "its finish",
            "requirement": f"`{self.subject}`",
        }[self.breaks]
        return what if self.at is None else f"{what} at {self.at:.4g} s"


class Certificate(Record):
    """All checks of one plan, with informative quantities, warnings and the proofs of continuous-time checks.

    Args:
        boxes: proofs of the continuous-time checks.
        judgements: the monitor's judgement of each requirement, if the plan has the right shape.
        delays: time robustness of each agent, if the plan passes.
    """

    mission: str
    checks: tuple[Check, ...]
    figures: tuple[Figure, ...] = ()
    warnings: tuple[str, ...] = ()
    between: tuple[Between, ...] = ()
    boxes: tuple[Boxes, ...] = ()
    judgements: tuple[Judgement, ...] = ()
    delays: tuple[Delay, ...] = ()

    @property
    def passed(self) -> bool:
        return all(check.passed for check in self.checks)

    @property
    def failures(self) -> tuple[Check, ...]:
        return tuple(check for check in self.checks if not check.passed)

    @property
    def at_steps_alone(self) -> tuple[Between, ...]:
        """Results of the requirements that are satisfied at the steps but fail, or may fail, between them."""
        return tuple(each for each in self.between if not each.holds)

    @property
    def violated_between(self) -> frozenset[str]:
        """Names of the requirements in ``at_steps_alone``."""
        return frozenset(each.requirement for each in self.at_steps_alone)

    def under(self, word: str) -> Certificate:
        """The certificate with ``word`` prefixed to the name of every check and of its proof."""
        return replace(
            self,
            checks=tuple(replace(check, name=f"{word} {check.name}") for check in self.checks),
            boxes=tuple(
                replace(each, claim=replace(each.claim, name=f"{word} {each.claim.name}")) for each in self.boxes
            ),
        )

    def joined(self, other: Certificate) -> Certificate:
        """A certificate with the entries of this one, followed by the entries of ``other``."""
        return replace(
            self,
            checks=self.checks + other.checks,
            figures=self.figures + other.figures,
            warnings=self.warnings + other.warnings,
            between=self.between + other.between,
            boxes=self.boxes + other.boxes,
            delays=self.delays + other.delays,
        )


def judged(
    name: str,
    subject: str,
    margin: float,
    unit: str,
    tolerance: float,
    *,
    at: float | None = None,
    agents: tuple[str, ...] = (),
    detail: str = "",
) -> Check:
    """A check that passes if and only if its margin is at least ``-tolerance``; it fails for a NaN margin."""
    return Check(name, subject, margin, unit, tolerance, margin >= -tolerance, at, agents, detail)
