"""Requests to replan the remaining part of a mission, and their results, as values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from enum import Enum

from missionc.backends.api import Impossible
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.late_dataclass import Record
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Compiled
from missionc.verification.certificate import Certificate
from missionc.verification.flight.way_missions import Ways
from missionc.verification.monitoring.read_trace import FlownSoFar

IN_TIME = Seconds(3.0)
"""Default time in seconds until the next plan has to be ready."""


class Flying(Record, eq=False):
    """Plan in flight, with its mission and trajectories.

    Args:
        checked: its mission, with a choice of engines; the remaining one, if it was itself planned in flight.
        trace: trace of the plan.
        flights: text of each agent's polynomials, by agent name.
        ways: texts of the transfers before and after the mission, by stage; None if unknown.
    """

    checked: Checked
    trace: Trace
    flights: Mapping[str, str]
    ways: Ways | None = None


class Request(Record, eq=False):
    """Request to replan after an event in flight, such as a lost or slow agent.

    Args:
        so_far: completed flight of the plan.
        lost: names of lost agents.
        slow: by agent name, new speed limits, m/s.
        texts: present texts of the mission's files, by name; missing ones are unchanged.
        given_up: names of dropped requirements.
        at: time of the stop command, seconds of the plan; default: time of the last samples.
        in_time: seconds after that until another plan has to be ready.
        clock: time limit of planning, seconds; default ``in_time``.
        ahead: seconds without contact if all agents continue, so that a later request has time for a stop.
        hurried: True if infeasibility on roadmaps counts as infeasibility, to save time.
        exports: names of additional formats of the new flight.
    """

    so_far: FlownSoFar
    lost: tuple[str, ...] = ()
    slow: Mapping[str, float] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    given_up: tuple[str, ...] = ()
    at: float | None = None
    in_time: Seconds = IN_TIME
    clock: Seconds | None = None
    ahead: float = math.inf
    options: Options = field(default_factory=Options)
    seed: int = 0
    hurried: bool = False
    exports: tuple[str, ...] = ()

    @property
    def moment(self) -> float:
        """Time of the stop command, seconds of the plan."""
        return self.so_far.until if self.at is None else self.at


class Way(Enum):
    """Kind of the replanning result."""

    KEPT = "the current plan remains valid"
    REPAIRED = "plan repaired"
    ANEW = "replanned"
    NONE = "no plan"


class Replanned(Record, eq=False):
    """Result of replanning: the kind of result, findings, and the new plan if there is one.

    Args:
        rest: remaining mission.
        certificate: certificate of the rest of the old plan, if that plan remains valid.
        compiled: plan of the rest; None if the old plan remains valid, or nothing was planned.
        begins: beginning of the rest, seconds of the flown plan.
        changed: agents with a changed path.
        stops: text of each agent's polynomials until the rest begins, by agent name.
        cannot: without a plan, requirements whose removal may allow one.
        flown_on: requirements violated if all agents continue without contact to the end; None if there is contact, or
            unknown.
        must_stop: True if continuing soon leads to contact, or may because of a deviating agent.
        seconds: total duration.
    """

    way: Way
    findings: tuple[Diagnostic, ...]
    rest: Checked | None = None
    certificate: Certificate | None = None
    compiled: Compiled | None = None
    begins: float | None = None
    changed: tuple[str, ...] = ()
    stops: Mapping[str, str] = field(default_factory=dict)
    cannot: tuple[str, ...] = ()
    flown_on: tuple[str, ...] | None = None
    must_stop: bool = False
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        return self.way is not Way.NONE and not has_errors(list(self.findings))

    @property
    def undecided(self) -> bool:
        """True if a plan may exist but was not found in time."""
        if self.way is not Way.NONE or self.compiled is None:
            return False
        return not isinstance(self.compiled.outcome, Impossible)

    @property
    def files(self) -> Mapping[str, bytes]:
        """Files of the new plan's folder, without failed exports; empty without a plan."""
        return self.compiled.files if self.compiled is not None and self.way is not Way.NONE else {}
