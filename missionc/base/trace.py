"""Traces: joint trajectories as arrays, shared by backends, files, the monitor and the emitters.

Numbers as text: counts with nouns, and decimal numbers that do not round small values to 0.

Optimality gap: objective value of a plan and a proven lower bound for every plan of the mission.

Verdicts of the monitor on requirements, as values and as text.

Planning methods: the method that found the trajectory of each agent, for summaries and plan.json.

Stage runs: attempts of a compilation in order, as plan.json records them and the report displays them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.notebook import Ground, paths, picture, preformatted, printed
from missionc.base.units import Seconds

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


DECIMALS = 3


def counted(number: int, noun: str) -> str:
    """Count and noun as text: ``1 agent``, ``3 agents``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def decimals(value: float) -> str:
    """Decimal number as text, ``0.018``; smaller values have one significant digit, ``-0.0004``, and 0 has no sign."""
    if value == 0 or not math.isfinite(value) or round(value, DECIMALS):
        return f"{value + 0.0:.{DECIMALS}f}"
    return f"{value:.1g}"


SAME = {"s": 1e-6, "m": 1e-3}
"""Tolerance, by unit, within which the value of a plan counts as equal to the lower bound."""

OBJECTIVE = {"s": "duration", "m": "distance"}


TOURS, COVER = "tours", "cover"
"""Methods that prove a lower bound: tours of the required regions, or an over-approximation of all motions (cover)."""


class Proven(Record):
    """Objective value of a plan (duration or total distance), and a lower bound ``least`` for every plan of the
    mission.

    Args:
        unit: unit of ``value`` and ``least``: ``s`` for ``minimize duration``, ``m`` for ``minimize distance``.
        by: method that proved the lower bound, ``TOURS`` or ``COVER``.
    """

    value: float
    least: float
    unit: str
    by: str

    @property
    def best(self) -> bool:
        """True if the plan is optimal: its value equals the lower bound within the tolerance."""
        return self.value - self.least <= SAME[self.unit]

    def __str__(self) -> str:
        plan = f"{OBJECTIVE[self.unit]} {self.value:.6g} {self.unit}"
        if self.best:
            return f"{plan}, optimal"
        gap = 1 - self.least / self.value
        return f"{plan}, lower bound {self.least:.6g} {self.unit}, optimality gap {100 * gap:.3g} %"

    def as_record(self) -> dict[str, object]:
        return {"value": self.value, "least": self.least, "unit": self.unit, "by": self.by}


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


SEARCH, SKETCH, TRANSPORT, POLISH = "search", "sketch", "transport", "polish"
METHODS = {
    "z3": "Z3",
    "cadical": "CaDiCaL",
    SEARCH: "search",
    SKETCH: "a polished sketch",
    TRANSPORT: "transport",
    POLISH: "polish",
}
"""Display name of each planning method, by its identifier in documents."""


class Solved(Record):
    """Names of the agents whose trajectory one planning method (``by``) found."""

    by: str
    agents: tuple[str, ...]

    def as_record(self) -> dict[str, object]:
        return {"by": self.by, "agents": list(self.agents)}


def solved_by(methods: Mapping[str, str]) -> tuple[Solved, ...]:
    """Agents grouped by planning method, solvers first.

    Args:
        methods: planning method of each agent, by agent name.
    """
    used = sorted(set(methods.values()), key=list(METHODS).index)
    return tuple(Solved(by, tuple(name for name, each in methods.items() if each == by)) for by in used)


def then_polished(solved: tuple[Solved, ...], agents: Iterable[str]) -> tuple[Solved, ...]:
    """Planning methods of a plan after the optimiser has changed the trajectories of all ``agents``."""
    return solved if solved and solved[-1].by == POLISH else (*solved, Solved(POLISH, tuple(agents)))


def solved_text(solved: Sequence[Solved]) -> str:
    """Planning methods as text, ``solved: 2 agents by Z3, 8 by search``; methods that changed agents again follow
    ``then``.

    The text is empty if no method is known.
    """
    parts: list[str] = []
    known: set[str] = set()
    for each in solved:
        count = str(len(each.agents)) if parts else counted(len(each.agents), "agent")
        parts.append(f"{'then ' if known.intersection(each.agents) else ''}{count} by {METHODS[each.by]}")
        known.update(each.agents)
    return f"solved: {', '.join(parts)}" if parts else ""


def read_solved(records: object, agents: Iterable[str]) -> tuple[Solved, ...]:
    """Parse the planning methods from the records of a document.

    Args:
        agents: names of the mission's agents.

    Raises:
        ValueError: the records are no records of known methods and agents of the mission.
    """
    names, found = frozenset(agents), []
    for record in records if isinstance(records, list) else [None]:
        match record:
            case {"by": str(by), "agents": [*listed]} if by in METHODS and names.issuperset(map(str, listed)):
                found.append(Solved(by, tuple(map(str, listed))))
            case _:
                raise ValueError("no record of a method and its agents")
    return tuple(found)


LAST = "result"
"""Value of ``then`` in the record of the last attempt."""


class StageRun(Record):
    """One attempt of a stage of the compilation.

    Args:
        stage: name of the stage, as in ``--emit strategy``.
        attempt: description of the attempt; empty if the stage has only one attempt.
        engine: backend of the attempt; empty if no backend ran.
        work: counted work, in units of ``backends.work``, to three decimals; 0 if the attempt is not counted.
        outcome: outcome of the attempt, as a phrase.
    """

    stage: str
    attempt: str
    engine: str
    work: float
    outcome: str


def stage_records(runs: Sequence[StageRun]) -> list[dict[str, object]]:
    """JSON records of the attempts; ``then`` names the stage that followed."""
    following = [*(each.stage for each in runs[1:]), LAST]
    return [
        {
            "stage": run.stage,
            "attempt": run.attempt,
            "engine": run.engine,
            "work": run.work,
            "outcome": run.outcome,
            "then": then,
        }
        for run, then in zip(runs, following, strict=False)
    ]


def read_stage_runs(records: object) -> tuple[StageRun, ...]:
    """Parse attempts from their JSON records.

    Raises:
        ValueError: the records are not records of attempts.
    """
    found = []
    for record in records if isinstance(records, list) else [None]:
        match record:
            case {
                "stage": str(stage),
                "attempt": str(attempt),
                "engine": str(engine),
                "work": int() | float() as work,
                "outcome": str(outcome),
            } if 0 <= work < math.inf:
                found.append(StageRun(stage, attempt, engine, work, outcome))
            case _:
                raise ValueError("no record of an attempt")
    return tuple(found)


Array: TypeAlias = "NDArray[np.float64]"
Flags: TypeAlias = "NDArray[np.bool_]"
Indices: TypeAlias = "NDArray[np.int64]"


class Trace(Record, eq=False):
    """Joint trajectory: the state of every agent at every step 0 … last, agents in mission order.

    Args:
        step: time between two states, seconds.
        position: agent centres, (agents, steps + 1, dim), metres.
        velocity: (agents, steps + 1, dim), m/s. For first-order dynamics, the constant velocity during the step that
            begins at the state (at the last state, of the step that ended there); for second-order dynamics, the
            velocity at the state.
        heading: (agents, steps + 1), rad; orientation at the beginning of the step that begins at the state.
        derived: names of ``velocity`` and ``heading`` if they were computed from recorded positions.

    Between two steps a first-order agent moves on a straight line at constant velocity; a second-order agent
    (``ir.dynamics``) has constant acceleration.
    """

    step: Seconds
    position: Array
    velocity: Array
    heading: Array
    derived: tuple[str, ...] = field(default=(), kw_only=True)

    def part(self, agents: Sequence[int], first: int, last: int) -> Trace:
        """Trace of some agents, by row, from the step ``first`` to the step ``last``, both included."""
        rows, steps = list(agents), slice(first, last + 1)
        return Trace(self.step, self.position[rows, steps], self.velocity[rows, steps], self.heading[rows, steps])

    @property
    def metres(self) -> float:
        """Total path length of all agents, metres, with straight lines between steps."""
        moves = self.position[:, 1:] - self.position[:, :-1]
        return float(((moves**2).sum(axis=-1) ** 0.5).sum())

    @property
    def effort(self) -> float:
        """Control effort: integral of the squared accelerations of all agents over time, m²/s³. [clot] (2)."""
        changes = self.velocity[:, 1:] - self.velocity[:, :-1]
        return float((changes**2).sum() / self.step)

    @property
    def lasts(self) -> int:
        """Number of steps after which all agents are at rest until the end of the trace."""
        moved = (self.position[:, 1:] != self.position[:, :-1]) | (self.velocity[:, :-1] != 0)
        steps = moved.any(axis=(0, 2)).nonzero()[0]
        return int(steps[-1]) + 1 if steps.size else 0


class Plan(Record, eq=False):
    """Verified joint plan, ready to be written; a notebook displays its paths and its verdicts."""

    mission: str
    backend: str
    seed: int
    trace: Trace
    judgements: tuple[Judgement, ...]
    proven: Proven | None = None
    """Lower bound of the objective, if the mission minimizes a quantity for which a bound is proved."""
    solved: tuple[Solved, ...] = ()
    """Planning method of each agent's trajectory; empty if unknown."""
    runs: tuple[StageRun, ...] = ()
    """Attempts of the compilation that led to the plan, in order; empty if unknown."""
    ground: Callable[[], Ground] | None = None
    """Function that computes the background of the paths for a notebook."""

    @property
    def times(self) -> Array:
        """Times of the steps, (steps + 1,), seconds."""
        import numpy as np

        return np.arange(self.trace.position.shape[1], dtype=np.float64) * self.trace.step

    @property
    def robustness(self) -> dict[str, float]:
        """Robustness of each requirement, by requirement name."""
        return {each.name: each.robustness for each in self.judgements}

    def __str__(self) -> str:
        agents, states, _ = self.trace.position.shape
        head = (
            f"{self.mission}: planned by {self.backend}, {agents} agent{'s' if agents > 1 else ''}, "
            f"{states - 1} step{'s' if states != 2 else ''} of {self.trace.step:g} s, seed {self.seed}"
        )
        known = filter(None, (solved_text(self.solved), str(self.proven) if self.proven else ""))
        return "\n".join([head, *judgement_lines(self.judgements, self.trace.step), *known])

    _repr_pretty_ = printed

    def _repr_html_(self) -> str:
        return picture(paths(self.trace.position.tolist(), self.ground() if self.ground else None)) + preformatted(
            str(self)
        )
