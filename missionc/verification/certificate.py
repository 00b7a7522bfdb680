"""The certificate: every check with its margin and tolerance, and informative figures.

Every check of the certificate repeats its numerical tolerance.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

from missionc.base.judgement import Judgement
from missionc.base.late_dataclass import Record
from missionc.verification.proof.proof_boxes import Boxes

MOTION = 1e-6
"""Metres, m/s, m/s² or rad: tolerance for states against the dynamics, and for exactly given places."""

CONTACT = 1e-9
"""Metres: tolerance of distances between bodies; contact is allowed, and rounding is not a defect."""

CERTAIN = 1e-5
"""Metres by which the continuous-time proof may be below the least margin seen."""

TUBE = 0.1
"""Metres: tolerance of the distance between a polynomial and the verified motion."""

WAYPOINT = 5e-3
"""Metres: tolerance of a polynomial's position at a step's time, for judging the mission again."""

ROUNDING = 1e-5
"""Metres by which float32 rounding of a polynomial may reduce a required distance."""

CLOCK = 1e-6
"""Seconds per second of the mission: durations are float32 numbers too."""


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
    """An informative number that no rule of the mission limits."""

    name: str
    subject: str
    value: float
    unit: str
    at: float | None = None
    agents: tuple[str, ...] = ()


class Verdict(Enum):
    """Continuous-time verdict on a requirement that is true at the steps."""

    HOLDS = "holds throughout"
    FAILS = "fails between"
    UNDECIDED = "not decided"


class Between(Record):
    """Result of a requirement between the steps.

    If it does not hold in continuous time, ``at`` and ``until`` (seconds) bound the first deciding interval, ``agents``
    lists the agents concerned, and ``detail`` is a sentence.
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
    """Delay tolerance of an agent, with all others on time, such that the plan satisfies the mission.

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
        """The check that one more step breaks, ``the separation from `drone[1]` at 4 s``.

        Empty if none is known.
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
    """All checks of one plan.

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
        """Results of the requirements that hold at the steps but fail, or may fail, between them."""
        return tuple(each for each in self.between if not each.holds)

    def under(self, word: str) -> Certificate:
        """The certificate with a word before the name of every check and of its boxes."""
        return replace(
            self,
            checks=tuple(replace(check, name=f"{word} {check.name}") for check in self.checks),
            boxes=tuple(
                replace(each, claim=replace(each.claim, name=f"{word} {each.claim.name}")) for each in self.boxes
            ),
        )

    def joined(self, other: Certificate) -> Certificate:
        """The certificate followed by the content of the other one."""
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
    """A check that passes if and only if its margin is at least ``-tolerance`` (never for NaN)."""
    return Check(name, subject, margin, unit, tolerance, margin >= -tolerance, at, agents, detail)
