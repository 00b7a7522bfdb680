"""Requests for a plan of the rest of a mission, and what becomes of them, as values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from missionc.backends.api import Impossible
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Compiled
from missionc.verification.certificate import Certificate
from missionc.verification.flight.way_missions import Ways
from missionc.verification.monitoring.read_trace import FlownSoFar

IN_TIME = Seconds(3.0)
"""Seconds in which another plan has to be ready, where nobody says otherwise."""


@dataclass(frozen=True, slots=True, eq=False)
class Flying:
    """A plan that is being flown.

    Args:
        checked: its mission, with a choice of engines: what is left of it where it was planned in flight itself.
        trace: the plan.
        flights: the text of each agent's polynomials, by the agent's name.
        ways: those before and after the mission, likewise; None where nothing is known of them.
    """

    checked: Checked
    trace: Trace
    flights: Mapping[str, str]
    ways: Ways | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """What happened, and what is asked.

    Args:
        so_far: what was flown of the plan.
        lost: the names of agents that are lost.
        slow: by their names, those who can go no faster than this from now on, m/s.
        texts: the mission's files as they read now, by their names; those that are missing read as before.
        given_up: names of requirements that nothing is asked of any more.
        at: seconds after the beginning of the plan, when everybody is told to stop; when it was seen last, if left out.
        in_time: seconds after that by which another plan has to be ready.
        clock: seconds that planning may take by the clock; as many where it is left out.
        ahead: seconds after the moment in which nobody may touch anything where everybody flies on: who asks again has
            time to stop then.
        hurried: whether what roadmaps do not hold is taken for what cannot be kept: there is no time to ask others.
        exports: names of forms that the new flight is written in as well.
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
        """When everybody is told to stop."""
        return self.so_far.until if self.at is None else self.at


class Way(Enum):
    """How the rest of a mission is flown."""

    KEPT = "the current plan remains valid"
    REPAIRED = "plan repaired"
    ANEW = "replanned"
    NONE = "no plan"


@dataclass(frozen=True, slots=True, eq=False)
class Replanned:
    """How a replanning ended.

    Args:
        rest: the mission that is left.
        certificate: of the rest of the plan, where that is kept.
        compiled: the plan of the rest; absent where the old one is kept, or where nothing was planned.
        begins: seconds after the beginning of the plan that was flown, at which the rest begins.
        changed: the agents that fly another way than they would have.
        stops: the text of the polynomials that each agent flies until the rest begins, by the agent's name.
        cannot: the names of requirements without which there may be a plan, where there is none.
        flown_on: the names of requirements that are lost where everybody flies on and touches nothing to the end; None
            where that is not so, or not known.
        must_stop: whether somebody touches something soon where everybody flies on, or is off its way and may.
        seconds: that all of it took.
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
        """Whether there may be a plan that was not found in time."""
        if self.way is not Way.NONE or self.compiled is None:
            return False
        return not isinstance(self.compiled.outcome, Impossible)

    @property
    def files(self) -> Mapping[str, bytes]:
        """The folder of the new plan, without exports that could not be made; nothing where there is no plan."""
        return self.compiled.files if self.compiled is not None and self.way is not Way.NONE else {}
