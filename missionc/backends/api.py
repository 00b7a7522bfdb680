"""The interface of backends: the features that each offers, and a function from a mission to an outcome.

``Planned`` (still to be judged by ``verify``), ``Impossible`` (a proof that
these roadmaps hold no plan, or that no motion is one, and the requirements it
rests on) and ``NotFound`` (the budget ran out; says nothing about whether a
plan exists) are never confused.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Protocol, TypeAlias

from missionc.backends.features import Feature
from missionc.backends.options import Options
from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.diagnostics.code import EXTENSION_FAILED
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.extensions import ExtensionError
from missionc.base.figures import counted
from missionc.base.judgement import Judgement
from missionc.base.limits import Limits
from missionc.base.notebook import printed, shown
from missionc.base.solved import Solved
from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


class Reason(Enum):
    """Why a search ended without an answer."""

    TIME = "the time limit was reached"
    MEMORY = "the memory limit was reached"
    SIZE = "the problem exceeds the size limit"
    NO_ROADMAP = "no roadmap could be built"
    SOLVER = "the solver gave up"
    DELAY = "no plan found tolerates the delay"
    METHOD = "the published method found no plan"


class CutShort(Enum):
    """What ended a search that had a plan and was still at work on a better one."""

    TIME = "time limit"
    MEMORY = "memory limit"
    SIGNAL = "interruption"
    UNFINISHED = "unfinished search"
    DEFECT = "defect of the compiler"

    @property
    def note(self) -> str:
        """What is said of the plan."""
        return f"the search stopped early ({self.value}) with the best plan found so far"


ACTIVITIES = {
    "check": "checking the mission",
    "lower": "encoding the mission",
    "roadmap": "building a roadmap",
    "encode": "encoding the mission",
    "discrete": "searching for paths on a roadmap",
    "sketch": "scheduling tasks",
    "search": "searching for trajectories",
    "polish": "optimizing trajectories",
    "solve": "searching for paths",
    "prefer": "adding a preference",
    "improve": "improving the plan",
    "straighten": "straightening paths",
    "verify": "verifying the plan",
    "emit": "fitting trajectories",
    "explain": "searching for suggested fixes",
}
"""The activity in each stage, in the user's terms."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a search.

    Args:
        stage: a key of ``ACTIVITIES``, or the activity itself.
        round: of the stage, from 1; for transport, the attempt.
        detail: free words.
        iteration: of the round, from 1; 0 where it has none.
        planned: how many agents are planned at most, where they are planned one by one, and how many there are.
        margin: the best worst margin of a candidate so far, metres; negative while something fails.
        engine: whose turn it is, in a portfolio.
    """

    stage: str
    round: int = 1
    detail: str = ""
    iteration: int = 0
    planned: tuple[int, int] | None = None
    margin: float | None = None
    engine: str = ""

    @property
    def activity(self) -> str:
        """Return the activity, its round and its backend: ``searching for paths, round 3 of smt``."""
        rounds = f", round {self.round}" if self.round > 1 else ""
        engine = f" {'of' if rounds else 'with'} {self.engine}" if self.engine else ""
        return f"{ACTIVITIES.get(self.stage, self.stage)}{rounds}{engine}"


def ignore(progress: Progress) -> None:
    """The listener of those who do not watch."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What a run knows between two of its steps: arrays of finite numbers by name, and words for JSON."""

    arrays: Mapping[str, Array]
    words: Mapping[str, Any]


class UnusableSnapshot(ValueError):
    """It holds no state of such a run."""


def discard_snapshot(snapshot: Snapshot) -> None:
    """What is kept of a run that nobody will take up again."""


def no_bound(value: float) -> float:
    """Nothing is known of the best plan, where one comes to so much."""
    return 0.0


def discard_plan(planned: Planned) -> None:
    """Nobody needs a plan before the best one is there."""


@dataclass(frozen=True, slots=True)
class Budget:
    """Limits of a run, and the functions that it calls.

    Args:
        deadline: end of the run on the clock of ``time.monotonic``, seconds.
        memory_bytes: memory that the run may use.
        seed: of the random numbers.
        limits: sizes that a mission must not exceed.
        on_progress: called with each progress report.
        on_snapshot: called with each state from which the run can be resumed.
        on_incumbent: called with each plan that the run then tries to improve.
        lower_bound: given a value of the objective (steps of ``minimize duration``, metres of ``minimize distance``),
            returns a proven lower bound that is at most this value. The search for a better plan ends if both are
            equal. The first call may take seconds.
        resume: snapshot of a run with the same mission, seed and options.
        work: units of ``work`` after which the run ends because another search follows.
        urgent: True if vehicles in flight wait for the plan: the first plan is returned.
    """

    deadline: float
    memory_bytes: int = 8 << 30
    seed: int = 0
    limits: Limits = field(default_factory=Limits)
    on_progress: Callable[[Progress], None] = ignore
    on_snapshot: Callable[[Snapshot], None] = discard_snapshot
    on_incumbent: Callable[[Planned], object] = discard_plan
    lower_bound: Callable[[float], float] = no_bound
    resume: Snapshot | None = None
    work: float = math.inf
    urgent: bool = False


@dataclass(frozen=True, slots=True)
class Tried:
    """An engine of a portfolio: its turns, the units of work and the seconds they took, and what it said."""

    engine: str
    turns: int
    work: float
    seconds: Seconds
    says: str

    def __str__(self) -> str:
        if not self.turns:
            return self.says
        return f"{counted(self.turns, 'turn')}, {self.work:.3g} units of work in {self.seconds:.1f} s: {self.says}"

    def as_record(self) -> dict[str, object]:
        return {
            "engine": self.engine,
            "turns": self.turns,
            "work": self.work,
            "seconds": self.seconds,
            "says": self.says,
        }


@dataclass(frozen=True, slots=True)
class Report:
    """What a run did: seconds by stage, sizes by name (``clauses``, ``nodes``, …), texts and proof files asked for."""

    seconds: tuple[tuple[str, Seconds], ...] = ()
    sizes: tuple[tuple[str, int], ...] = ()
    texts: tuple[tuple[str, str], ...] = ()
    files: tuple[tuple[str, bytes], ...] = ()
    notes: tuple[str, ...] = ()
    cut_short: CutShort | None = None
    """The limit or signal that ended the search: another run, with more time, may find another plan."""
    work: float = 0.0
    """Units of ``work`` that were done."""
    kept: float = 1.0
    """The share of the margin that was asked for by which the plan keeps its requirements."""
    engine: str = ""
    """Which engine of a portfolio gave the plan, the refusal or the best candidate; empty where there was none."""
    tried: tuple[Tried, ...] = ()
    """The engines of a portfolio, in their order."""
    solved: tuple[Solved, ...] = ()
    """Which method found the motion of which agents of a plan."""
    roadmaps: tuple[RoadmapGraph, ...] = ()
    """Those that a plan was found on, before it was straightened; none where it was found on none."""

    def noting(self, *notes: str) -> Report:
        """This report with further notes."""
        return replace(self, notes=(*self.notes, *notes))


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    trace: Trace
    report: Report

    def noting(self, note: str) -> Planned:
        """This plan with one more note in its report."""
        return replace(self, report=self.report.noting(note))


class Scope(Enum):
    """What a refusal is about: the value is its name in JSON."""

    ROADMAPS = "roadmaps"
    """The motions of some roadmaps; of others it says nothing."""
    MISSION = "mission"
    """Every motion of the agents, whatever the roadmap."""


@dataclass(frozen=True, slots=True, eq=False)
class Impossible:
    """No plan in the ``scope``. ``conflict``: names of the requirements the proof rests on (none: motion alone).

    ``smallest``: every proper subset of the conflict can hold on this abstraction. Otherwise that was not found out.
    """

    conflict: tuple[str, ...]
    statement: str
    report: Report
    scope: Scope = Scope.ROADMAPS
    smallest: bool = False

    @property
    def says(self) -> str:
        """Which requirements are in conflict, of those there are any."""
        names = ", ".join(f"`{name}`" for name in self.conflict)
        return f"{names} cannot be satisfied together" if len(self.conflict) > 1 else f"{names} cannot be satisfied"

    @property
    def doubt(self) -> str:
        """That the conflict may not be smallest, where that was not found out."""
        return "" if self.smallest or not self.conflict else "a smaller conflict may exist among these requirements"

    def __str__(self) -> str:
        head = self.says if self.conflict else "no plan exists, even without the requirements"
        where = "for any motion of these agents" if self.scope is Scope.MISSION else "on the roadmap"
        return "\n  ".join(filter(None, (f"{head}, {where}", self.statement, self.doubt)))

    _repr_pretty_ = printed
    _repr_html_ = shown


@dataclass(frozen=True, slots=True)
class Violation:
    """What a motion breaks apart from requirements: who does, at which step, and by what margin.

    Margins are in metres, or in the ``unit`` of what is broken. One that is no number is 0.
    """

    what: str
    agents: tuple[str, ...] = ()
    step: int = 0
    margin: float = 0.0
    unit: str = "m"

    @property
    def short(self) -> str:
        """By how much: ``0.2 m``; empty where that is not known."""
        return f"{-self.margin:.3g} {self.unit}".rstrip() if self.margin < 0 else ""

    def as_record(self) -> dict[str, object]:
        return {
            "what": self.what,
            "margin": self.margin,
            "unit": self.unit,
            "step": self.step,
            "agents": list(self.agents),
        }

    def violation(self, step: Seconds) -> str:
        """``breaks separation by 0.2 m at 3 s by drone[0], drone[1]``; ``step`` is the mission's, seconds."""
        much = f" by {self.short}" if self.short else ""
        who = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates {self.what}{much} at {self.step * step:g} s{who}"


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """A motion and what it comes to: each requirement with its robustness, and everything else that it breaks."""

    requirements: tuple[Judgement, ...]
    faults: tuple[Violation, ...]
    trace: Trace

    @property
    def is_plan(self) -> bool:
        return not self.faults and all(each.satisfied for each in self.requirements)

    @property
    def violated(self) -> tuple[Judgement, ...]:
        return tuple(each for each in self.requirements if not each.satisfied)

    @property
    def shown(self) -> tuple[Judgement | Violation, ...]:
        """Everything that is wrong, and of each kind of fault the worst."""
        return (*self.violated, *self.worst_faults())

    @property
    def wrong(self) -> int:
        """How many things are."""
        return len(self.faults) + len(self.violated)

    def violation(self, step: Seconds) -> str:
        """The first thing that is wrong, in words, and how many more there are; ``step`` is the mission's, seconds."""
        wrong = self.shown
        more = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
        return f"{wrong[0].violation(step)}{more}" if wrong else "satisfies everything"

    def worst_faults(self) -> tuple[Violation, ...]:
        """The worst fault of each kind."""
        worst: dict[str, Violation] = {}
        for fault in self.faults:
            if fault.what not in worst or fault.margin < worst[fault.what].margin:
                worst[fault.what] = fault
        return tuple(worst.values())


@dataclass(frozen=True, slots=True, eq=False)
class NotFound:
    """No plan was found. ``best`` is the candidate that came nearest, where one was finished; it is no plan."""

    reason: Reason
    statement: str
    report: Report
    best: Attempt | None = None

    @property
    def says(self) -> tuple[str, ...]:
        """That it is undecided and why; and the statement, where it says more."""
        head = f"undecided: {self.reason.value}"
        return (head,) if self.statement == self.reason.value else (head, self.statement)

    def __str__(self) -> str:
        lines = ["\n  ".join(self.says)]
        lines += [f"  the best candidate {self.best.violation(self.best.trace.step)}"] if self.best else []
        return "\n".join(lines)

    _repr_pretty_ = printed
    _repr_html_ = shown


Outcome: TypeAlias = Planned | Impossible | NotFound

Turns: TypeAlias = Generator[float, float, Outcome]
"""A search in turns, which ends with its outcome.

It yields the units of ``work`` it has done, at first 0, and is sent how many it may have done before it yields again.
What it does next is never cut into less than it can be, so that a turn may be longer.
"""


Straighten: TypeAlias = Callable[[Mission, Kernel, Planned, Budget], Planned]
"""A plan as it is, or a straighter one of the same mission; still to be judged by ``verify``."""


class Backend(Protocol):
    """One way to plan. What it offers is in ``registry.BACKENDS``, a table that loads no solver.

    ``refutes``: it may find a mission impossible; else it searches until it has a plan, or its time is up.
    """

    name: str
    refutes: bool

    def missing(self, options: Options) -> Diagnostic | None:
        """What to say where these options need a package or a device that is not there."""

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """A search for a joint motion that satisfies every requirement, in turns."""

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """All its turns, one after the other."""


class BackendExtension(ABC):
    """Base class of backends of other packages. The compiler verifies every plan, and searches for none itself.

    ``features`` are all that a mission it plans may need, ``options`` the names of ``Options`` that it reads.
    """

    name: str
    features: frozenset[Feature] = frozenset()
    options: frozenset[str] = frozenset({"margin", "stretch"})
    refutes: bool = False

    def missing(self, options: Options) -> Diagnostic | None:
        """Return what these options need and is not there; by default nothing."""
        return None

    @abstractmethod
    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """Search for a joint motion that satisfies every requirement, until ``budget.deadline``."""

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """Search in turns; by default in one."""
        yield 0.0
        return check_outcome(self.plan(mission, kernel, options, budget), self.name, mission)


def check_outcome(outcome: Outcome, name: str, mission: Mission) -> Outcome:
    """Return the outcome of a backend as it is.

    Raises:
        ExtensionError: it is no outcome, or its trace has not the shape of a motion of these agents.
    """
    help_ = f"report it to the authors of the backend `{name}`"
    if not isinstance(outcome, Planned | Impossible | NotFound):
        message = f"the backend `{name}` returned neither `Planned`, `Impossible` nor `NotFound`"
        raise ExtensionError(EXTENSION_FAILED, message, help_)
    shape = (len(mission.agents), mission.steps + 1, mission.dimension)
    if isinstance(outcome, Planned) and (found := outcome.trace.position.shape) != shape:
        message = f"the backend `{name}` returned positions of the shape {found}; this mission needs {shape}"
        raise ExtensionError(EXTENSION_FAILED, message, help_)
    return outcome
