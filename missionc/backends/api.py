"""Interface of backends: the features of each, and a function from a mission to an outcome.

There are three outcomes. ``Planned`` is a plan, which ``verify`` still has to check. ``Impossible`` is a proof that
some roadmaps, or all trajectories, contain no plan, with the requirements that the proof uses. ``NotFound`` means that
the budget ran out; a plan may exist.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from dataclasses import field, replace
from enum import Enum
from typing import Any, Protocol, TypeAlias

from missionc.backends.features import Feature
from missionc.backends.options import Options
from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.notebook import printed, shown
from missionc.base.trace import Array, Judgement, Solved, Trace, counted
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


class Reason(Enum):
    """Reason for which a search ended without an answer; the value is its text in messages."""

    TIME = "the time limit was reached"
    MEMORY = "the memory limit was reached"
    SIZE = "the problem exceeds the size limit"
    NO_ROADMAP = "no roadmap could be built"
    SOLVER = "the solver gave up"
    DELAY = "no plan found tolerates the delay"
    METHOD = "the published method found no plan"


class CutShort(Enum):
    """Reason for which a search that had a plan stopped improving it; the value is its text in notes."""

    TIME = "time limit"
    MEMORY = "memory limit"
    SIGNAL = "interruption"
    UNFINISHED = "unfinished search"
    DEFECT = "defect of the compiler"

    @property
    def note(self) -> str:
        """Text of the note that the search stopped early with its best plan, and why."""
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
    "margins": "widening margins",
    "verify": "verifying the plan",
    "emit": "fitting trajectories",
    "explain": "searching for suggested fixes",
}
"""Description of each stage of planning for progress messages."""


class Progress(Record):
    """Progress report of a search.

    Args:
        stage: a key of ``ACTIVITIES``, or a description of the activity.
        round: round of the stage, from 1; for transport, the attempt.
        detail: additional text.
        iteration: iteration in the round, from 1; 0 if the round has none.
        planned: number of agents planned so far and number of agents, for stages that plan agents one by one.
        margin: largest worst-case margin of a candidate so far, metres; negative if a constraint is violated.
        engine: name of the running backend in a portfolio; empty otherwise.
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
        """Description of the activity with its round and backend: ``searching for paths, round 3 of smt``."""
        rounds = f", round {self.round}" if self.round > 1 else ""
        engine = f" {'of' if rounds else 'with'} {self.engine}" if self.engine else ""
        return f"{ACTIVITIES.get(self.stage, self.stage)}{rounds}{engine}"


def ignore(progress: Progress) -> None:
    """Progress listener without effect."""


class Snapshot(Record, eq=False):
    """Resumable state of a search: arrays of finite numbers by name, and JSON values by name."""

    arrays: Mapping[str, Array]
    words: Mapping[str, Any]


class UnusableSnapshot(ValueError):
    """Error for a snapshot that is no state of a search of this kind."""


def discard_snapshot(snapshot: Snapshot) -> None:
    """Snapshot listener without effect."""


def no_bound(value: float) -> float:
    """Lower bound function of an objective without a known bound: always 0."""
    return 0.0


def discard_plan(planned: Planned) -> None:
    """Listener without effect for intermediate plans."""


class Budget(Record):
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
        violated_in_flight: names of the requirements that hold at the samples of a plan, but not between samples of its
            flight; None if only samples count.
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
    violated_in_flight: Callable[[Trace], frozenset[str]] | None = None


class Tried(Record):
    """Summary of one engine in a portfolio: its turns, work units and seconds, and a text about its result."""

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


class Report(Record):
    """Record of a search: seconds by stage, sizes by name (``clauses``, ``nodes``, …), requested texts, and proof
    files."""

    seconds: tuple[tuple[str, Seconds], ...] = ()
    sizes: tuple[tuple[str, int], ...] = ()
    texts: tuple[tuple[str, str], ...] = ()
    files: tuple[tuple[str, bytes], ...] = ()
    notes: tuple[str, ...] = ()
    cut_short: CutShort | None = None
    """Reason for which the search stopped improving its plan; None if it did not stop early."""
    work: float = 0.0
    """Work of the search, in units of ``work``."""
    kept: float = 1.0
    """Fraction of the requested margin that the plan satisfies."""
    engine: str = ""
    """Engine of a portfolio that found the plan, the refusal or the best candidate; empty without a portfolio."""
    tried: tuple[Tried, ...] = ()
    """Summaries of all engines of a portfolio, in the order of their turns."""
    solved: tuple[Solved, ...] = ()
    """Planning method by which the trajectories of each group of agents were found."""
    roadmaps: tuple[RoadmapGraph, ...] = ()
    """Roadmaps on which the plan was found, before it was straightened; empty for a plan without roadmaps."""

    def noting(self, *notes: str) -> Report:
        """Report with additional notes."""
        return replace(self, notes=(*self.notes, *notes))


class Planned(Record, eq=False):
    trace: Trace
    report: Report

    def noting(self, note: str) -> Planned:
        """Plan with one more note in its report."""
        return replace(self, report=self.report.noting(note))


class Scope(Enum):
    """Scope of a refusal, that is, the set of trajectories among which no plan exists; the value is its name in
    JSON."""

    ROADMAPS = "roadmaps"
    """Only the trajectories on certain roadmaps."""
    MISSION = "mission"
    """All trajectories of the agents."""


class Impossible(Record, eq=False):
    """Proof that no plan exists in the ``scope``.

    Args:
        conflict: names of the requirements that the proof uses; empty if the agents' motion alone is infeasible.
        smallest: True if every proper subset of the conflict is known to be satisfiable on the same abstraction.
    """

    conflict: tuple[str, ...]
    statement: str
    report: Report
    scope: Scope = Scope.ROADMAPS
    smallest: bool = False

    @property
    def says(self) -> str:
        """Sentence that the conflicting requirements cannot be satisfied; without names if the conflict names no
        requirement."""
        names = ", ".join(f"`{name}`" for name in self.conflict)
        return f"{names} cannot be satisfied together" if len(self.conflict) > 1 else f"{names} cannot be satisfied"

    @property
    def doubt(self) -> str:
        """Note that a smaller conflict may exist, unless the conflict is known to be minimal."""
        return "" if self.smallest or not self.conflict else "a smaller conflict may exist among these requirements"

    def __str__(self) -> str:
        head = self.says if self.conflict else "no plan exists, even without the requirements"
        where = "for any motion of these agents" if self.scope is Scope.MISSION else "on the roadmap"
        return "\n  ".join(filter(None, (f"{head}, {where}", self.statement, self.doubt)))

    _repr_pretty_ = printed
    _repr_html_ = shown


class Violation(Record):
    """Violated constraint other than a requirement: its name, the agents, the step, and the negative margin.

    The margin is in ``unit``; 0 replaces a margin of NaN.
    """

    what: str
    agents: tuple[str, ...] = ()
    step: int = 0
    margin: float = 0.0
    unit: str = "m"

    @property
    def short(self) -> str:
        """Amount of the violation as text, ``0.2 m``; empty if unknown."""
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
        """Violation as text: ``violates separation by 0.2 m at 3 s by drone[0], drone[1]``.

        Args:
            step: duration of a step, seconds.
        """
        much = f" by {self.short}" if self.short else ""
        who = f" by {', '.join(self.agents)}" if self.agents else ""
        return f"violates {self.what}{much} at {self.step * step:g} s{who}"


class Attempt(Record, eq=False):
    """Candidate trajectory with its evaluation: a verdict on each requirement, and all violated constraints
    (``faults``)."""

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
        """Violated requirements, and the worst violation of each other constraint."""
        return (*self.violated, *self.worst_faults())

    @property
    def wrong(self) -> int:
        """Number of violations."""
        return len(self.faults) + len(self.violated)

    def violation(self, step: Seconds) -> str:
        """Text of the first violation, and the number of other violations.

        Args:
            step: duration of a step, seconds.
        """
        wrong = self.shown
        more = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
        return f"{wrong[0].violation(step)}{more}" if wrong else "satisfies everything"

    def worst_faults(self) -> tuple[Violation, ...]:
        """Worst violation of each constraint other than a requirement."""
        worst: dict[str, Violation] = {}
        for fault in self.faults:
            if fault.what not in worst or fault.margin < worst[fault.what].margin:
                worst[fault.what] = fault
        return tuple(worst.values())


class NotFound(Record, eq=False):
    """Outcome of a search without a plan; ``best`` is the closest infeasible candidate, if there is one."""

    reason: Reason
    statement: str
    report: Report
    best: Attempt | None = None

    @property
    def says(self) -> tuple[str, ...]:
        """Sentences of the message: the verdict *undecided* with its reason, and the statement if it differs from the
        reason."""
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
"""Search in turns: a generator that returns its outcome at the end.

It yields the units of ``work`` done so far, at first 0, and receives the total that it may reach before it yields
again. The smallest pieces of work are not divided, so a turn may be longer.
"""


Improvement: TypeAlias = Callable[[Mission, Kernel, Planned, Budget], Planned]
"""Function from a plan to the same plan or a better one; the result must still be verified."""


class Backend(Protocol):
    """Interface of a planning backend. ``registry.BACKENDS`` describes the backends without loading a solver.

    ``refutes`` is true if the backend may prove a mission infeasible; otherwise it searches until it has a plan or its
    time is up.
    """

    name: str
    refutes: bool

    def missing(self, options: Options) -> Diagnostic | None:
        """Finding if a package or device that these options need is missing; None otherwise."""

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """Search, in turns, for a joint trajectory that satisfies every requirement."""

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """Outcome of the search after all its turns."""


class BackendExtension(ABC):
    """Base class of backends in extension packages; they are used only if a mission or the command line names them.

    The compiler verifies every plan of such a backend, and ignores its other claims. ``features`` are all features that
    its missions may need, and ``options`` the names of the ``Options`` that it reads.
    """

    name: str
    features: frozenset[Feature] = frozenset()
    options: frozenset[str] = frozenset({"margin", "stretch"})

    @abstractmethod
    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """Search for a joint trajectory that satisfies every requirement, until ``budget.deadline``."""
