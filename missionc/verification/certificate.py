"""The certificate: every check with its margin and its tolerance, and figures that judge nothing.

Every check of the certificate repeats the numerical tolerance that it was judged with.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

from missionc.base.judgement import Judgement
from missionc.base.late_dataclass import Record
from missionc.verification.proof.proof_boxes import Boxes

MOTION = 1e-6
"""Metres, m/s, m/s² or rad: agreement of states with the dynamics, and of places with what was asked exactly."""

CONTACT = 1e-9
"""Metres: bodies that keep all of a distance but this much keep it; touching is allowed, rounding is not a defect."""

CERTAIN = 1e-5
"""Metres: how far below the least margin seen the proof for the time in between may stay."""

TUBE = 0.1
"""Metres: how far a polynomial may stray from the verified motion."""

WAYPOINT = 5e-3
"""Metres: how far from a step's position a polynomial may be at its time, where the mission is judged once more."""

ROUNDING = 1e-5
"""Metres: what the float32 numbers of a polynomial may cost of a required distance."""

CLOCK = 1e-6
"""Seconds, for each second of the mission: durations are float32 numbers too."""


class Check(Record):
    """One thing that was checked, and how far it is from failing.

    ``margin`` is the slack in ``unit``: what is allowed minus what is there.
    The check passes while it is at least ``-tolerance``, unless a witness says
    otherwise (``detail`` tells). ``at`` is the time of the smallest margin in
    seconds, ``agents`` whom it concerns.
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
    """A number worth knowing that no rule of the mission judges."""

    name: str
    subject: str
    value: float
    unit: str
    at: float | None = None
    agents: tuple[str, ...] = ()


class Verdict(Enum):
    """The verdict on a requirement that is true at the steps, at every moment between them."""

    HOLDS = "holds throughout"
    FAILS = "fails between"
    UNDECIDED = "not decided"


class Between(Record):
    """What becomes of a requirement between the steps.

    Where it does not hold throughout, ``at`` and ``until`` (seconds) are the first moments that decide it, ``agents``
    whom they are about, and ``detail`` is a sentence.
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
    """By how much an agent may be late, all others on time, while the plan keeps all that is asked.

    ``tolerated`` are seconds: late by any number of steps up to that, nothing breaks. One step more breaks the check
    called ``breaks`` of ``subject``, at the time ``at``, by ``agents``; where that is empty nothing was seen to break:
    up to the end of the mission, or (``open``) as far as was looked.
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
        """What one step more breaks, ``the separation from `drone[1]` at 4 s``; empty where nothing is seen to."""
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
    """Everything that was checked on one plan.

    Args:
        boxes: the proofs of those checks that are about every moment of a flight.
        judgements: how the monitor judged each requirement, where the plan has the right shape to be judged.
        delays: the time robustness of each agent, where the plan passes.
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
        """What becomes of the requirements that hold at the steps, and fail between them or may do so."""
        return tuple(each for each in self.between if not each.holds)

    def under(self, word: str) -> Certificate:
        """This certificate, with the word before the name of every check and of its boxes."""
        return replace(
            self,
            checks=tuple(replace(check, name=f"{word} {check.name}") for check in self.checks),
            boxes=tuple(
                replace(each, claim=replace(each.claim, name=f"{word} {each.claim.name}")) for each in self.boxes
            ),
        )

    def joined(self, other: Certificate) -> Certificate:
        """This certificate, and after it what the other one holds."""
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
    """A check that passes exactly where its margin is at least ``-tolerance`` (never where it is not a number)."""
    return Check(name, subject, margin, unit, tolerance, margin >= -tolerance, at, agents, detail)
