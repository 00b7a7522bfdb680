"""Hybrid backend: SAT on a roadmap for the discrete part of a mission, then trajectory optimisation from its plan.

    in   Mission, its kernel
    out  Planned or NotFound

The discrete relaxation omits metric conditions and has longer time steps. Formations and lengths in metres are rarely
satisfied at nodes, so they count as satisfied in either polarity. Every plan of the mission satisfies the relaxation,
up to the rounding of windows.

Z3 chooses the relays, their links and their times. Its trajectory is resampled to the mission's own steps, and
optimisation starts from it. Z3's choices are fixed for the requirements that a roadmap can decide. If the optimisation
fails, other plans of Z3 follow, and sometimes an initial trajectory of the optimal-transport backend.

A roadmap without a plan proves nothing about the world between its nodes, so this backend never reports that a mission
is infeasible.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import ceil, floor

import numpy as np

from missionc.backends import api
from missionc.backends.clot.backend import TransportRun as Smooth
from missionc.backends.clot.backend import device_missing
from missionc.backends.clot.optimise.active_set import Choices, Demand
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.run.run_state import Reached
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.settings import clot_settings
from missionc.backends.options import Options
from missionc.backends.run_account import run_to_end
from missionc.backends.smt import backend as smt
from missionc.backends.smt.sat.installed_solvers import solver_missing
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Solved, Trace, then_polished
from missionc.base.units import Seconds, Steps
from missionc.geometry.dynamics import States, motions_between
from missionc.ir import Dynamics, Mission, Objective
from missionc.ir.dynamics.kinds import of_first_order
from missionc.ir.kernel.analysis import reads_lengths, steps_ahead
from missionc.ir.kernel.nodes import Atom, Goal, Kernel, Node, Not, PathLength, RouteNode, UntilNode, WindowNode
from missionc.ir.kernel.normal_form import YES, constant, folded
from missionc.ir.kernel.walk import awaited, bottom_up, postorder

SLACK = 1e-9
"""Rounding tolerance of a whole number of steps, as a fraction of a step."""


class Clock(Record):
    """Conversion of the mission's ``steps`` to the ``ticks`` (longer steps) of the roadmap.

    ``careful`` is true if windows may grow by rounding.
    """

    steps: int
    ticks: int
    careful: bool = True

    def window(self, low: int, high: int | None, every: bool) -> tuple[int, int | None]:
        """Time window in ticks: rounded outward for ``every`` (at its end only if ``careful``), rounded inward
        otherwise.

        Args:
            low, high: window in steps of the mission; ``high`` None is the last step.
        """
        first, last = low * self.ticks / self.steps, None if high is None else high * self.ticks / self.steps
        if every:
            begin, end = floor(first + SLACK), None
            if last is not None:
                end = ceil(last - SLACK) if self.careful else floor(last + SLACK)
        else:
            begin, end = ceil(first - SLACK), None if last is None else floor(last + SLACK)
            begin = min(begin, self.ticks)
            if end is not None and begin > end:
                begin = end
        return begin, end


class Discrete(Record, eq=False):
    """Discrete relaxation of the requirements; ``whole`` names the requirements without metric conditions."""

    kernel: Kernel
    whole: frozenset[str]


def discrete(kernel: Kernel, steps: int, ticks: int) -> Discrete:
    """Relaxation of a kernel with ``steps`` steps for a roadmap with ``ticks`` ticks."""
    goals = _goals(kernel, Clock(steps, ticks))
    ahead = steps_ahead(goal.formula for goal in goals)
    if any(ahead[goal.formula] > ticks for goal in goals):
        goals = _goals(kernel, Clock(steps, ticks, careful=False))
    whole = frozenset(goal.name for goal in kernel.requirements if not any(map(_measures, postorder((goal.formula,)))))
    return Discrete(Kernel(tuple(goal for goal in goals if constant(goal.formula) is not True), ()), whole)


def _measures(node: Node) -> bool:
    return reads_lengths(node) or (isinstance(node, Atom) and node.predicate.is_exact)


def _goals(kernel: Kernel, clock: Clock) -> list[Goal]:
    formulas = (goal.formula for goal in kernel.requirements)
    relaxed = bottom_up(formulas, lambda node, parts: _relaxed(node, parts, clock))
    return [Goal(goal.name, relaxed[goal.formula], goal.span) for goal in kernel.requirements]


def _relaxed(node: Node, parts: tuple[Node, ...], clock: Clock) -> Node:
    """Relaxed formula over relaxed children, with windows in ticks."""
    match node:
        case PathLength() | Not(PathLength()) | RouteNode():
            return YES
        case Atom(predicate) | Not(Atom(predicate)) if predicate.is_exact:
            return YES
        case WindowNode() | UntilNode():
            low, high = clock.window(node.low, node.high, node.every)
            return folded(replace(node, low=low, high=high), parts)
        case _:
            return folded(node, parts)


def on_clock(mission: Mission, ticks: int) -> Mission:
    """Mission with ``ticks`` steps of equal duration, for first-order agents; without preferences and objective."""
    step = Seconds(mission.horizon / ticks)
    agents = tuple(replace(each, dynamics=first_order(each.dynamics, step)) for each in mission.agents)
    return replace(mission, agents=agents, step=step, steps=Steps(ticks), preferences=(), objective=Objective.NONE)


def first_order(dynamics: Dynamics, step: float) -> Dynamics:
    """First-order dynamics at a speed that the given dynamics can follow.

    For an agent with momentum, the speed is the mean speed of a path from rest to rest in ``REST`` steps.

    Args:
        step: duration of a step, seconds.
    """
    rest = 3  # ticks from one rest to the next: the corners that a plan on the roadmap may turn
    if not dynamics.has_momentum and not dynamics.faces_ahead:
        return dynamics
    speed, slowing = dynamics.top_speed, dynamics.top_acceleration * rest * step
    return of_first_order(slowing / 4 if slowing <= 2 * speed else speed - speed**2 / slowing)


def positions(mission: Mission, motion: Trace) -> Array:
    """Positions of a trace with any step duration at the mission's own steps, (agents, steps + 1, dim), metres."""
    time = np.arange(mission.steps + 1) * mission.step
    last = motion.position.shape[1] - 2
    tick = np.clip(np.floor(time / motion.step).astype(np.int64), 0, last)
    since = (time - tick * motion.step)[:, None]
    position = np.zeros((len(mission.agents), len(time), mission.dimension))
    for agent in mission.agents:
        states = States(motion.position[agent.index], motion.velocity[agent.index])
        motions = motions_between(agent.dynamics, states.take(tick), states.take(tick + 1), motion.step)
        position[agent.index] = motions.at(since)
    return position


@dataclass(slots=True)
class HybridBackend:
    """Backend that solves discrete conditions with Z3, and metric conditions by trajectory optimisation."""

    name: str = "hybrid"
    refutes: bool = False

    def missing(self, options: Options) -> Diagnostic | None:
        """Finding if the required solver or device is missing; None otherwise."""
        return solver_missing(options) or device_missing(options)

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget) -> api.Outcome:
        """Outcome of the search for a joint trajectory that satisfies every requirement."""
        return run_to_end(self.turns(mission, kernel, options, budget), budget)

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget) -> api.Turns:
        """Search in turns, each of which consists of complete attempts."""
        yield 0.0
        return (yield from Run(mission, kernel, options, budget).turns())


BACKEND = HybridBackend()


class Start(Record, eq=False):
    """Initial trajectory of the optimisation, (agents, steps + 1, dim), metres, and its discrete choices."""

    position: Array
    choices: Choices
    solved: tuple[Solved, ...]


@dataclass(slots=True)
class Run:
    mission: Mission
    kernel: Kernel
    options: Options
    budget: api.Budget
    smooth: Smooth = field(init=False)
    asked: Discrete = field(init=False)
    on_roadmap: Mission = field(init=False)

    @property
    def refused(self) -> str:
        """Reason for which Z3 is no longer used; empty while it is used."""
        return self.smooth.beside.get("refused", "")

    @refused.setter
    def refused(self, why: str) -> None:
        self.smooth.beside["refused"] = why

    def __post_init__(self) -> None:
        most_ticks = 30  # on the roadmap's clock, which is coarser for longer missions
        self.smooth = Smooth(self.mission, self.kernel, self.options, self.budget)
        ticks = min(self.mission.steps, most_ticks)
        self.asked = discrete(self.kernel, self.mission.steps, ticks)
        self.on_roadmap = on_clock(self.mission, ticks)
        if not self.asked.kernel.requirements:
            self.refused = "the mission has no requirement for a roadmap"

    def turns(self) -> api.Turns:
        outcome = yield from self.smooth.turns(self.attempt)
        if not isinstance(outcome, api.NotFound):
            return outcome
        return replace(outcome, statement="; ".join(part for part in (outcome.statement, self.refused) if part))

    def attempt(self, number: int) -> Reached | None:
        own = 3  # number of first motions of which one is clot's own sketch, while the solver finds others
        start = None if self.refused or number % own == own - 1 else self.start(number)
        if start is None:
            return self.smooth.attempt(number)
        reached = self.smooth.polished(start.position, start.choices, number)
        if reached is None:
            return None
        return replace(reached, solved=then_polished(start.solved, self.mission.names))

    def start(self, number: int) -> Start | None:
        """Plan of Z3 for the discrete part in attempt ``number``, with its choices; None if Z3 finds none."""
        discrete = 20.0  # units of work for one plan on the roadmap
        account, budget = self.smooth.account, self.budget
        self.smooth.tell("discrete", number)
        seed = budget.seed * clot_settings(self.mission).attempts.schedules + number
        with account.stage("discrete"):
            asked = replace(
                budget,
                seed=seed,
                on_progress=api.ignore,
                on_incumbent=api.discard_plan,
                lower_bound=api.no_bound,
                on_snapshot=api.discard_snapshot,
                resume=None,
                work=discrete,
                violated_in_flight=None,
            )
            options = Options(solver=self.options.solver, require_solver=self.options.require_solver)
            outcome = smt.BACKEND.plan(self.on_roadmap, self.asked.kernel, options, asked)
            account.work += outcome.report.work
        match outcome:
            case api.Planned(trace, report):
                account.sizes |= {name: size for name, size in report.sizes if name in ("nodes", "clauses")}
            case api.Impossible(_, statement) | api.NotFound(_, statement):
                self.refused = statement
                account.notes.append(f"planned in continuous space only, without a roadmap: {statement}")
                return None
        with account.stage("witness"):
            first = positions(self.mission, trace)
            return Start(first, self.decided(first, number), report.solved)

    def decided(self, first: Array, number: int) -> Choices:
        """Choices of Z3 for discrete requirements, and of a schedule for the others.

        Args:
            first: Z3's trajectory, (agents, steps + 1, dim), metres.
        """
        mission = self.mission
        made = splines(mission)
        roots = tuple(each.formula for each in self.smooth.graph.requirements if each.name in self.asked.whole)
        witness = Demand.of(mission, roots, {}, mission.steps).witness(*made.states(made.through(first)))
        taken = [step for (term, _, _), step in witness.items() if awaited(term)]
        scheduler = Scheduler(
            mission, self.smooth.asked, self.smooth.geodesics, np.random.default_rng([self.budget.seed, number])
        )
        choices = dict(scheduler.schedule(clot_settings(self.mission).attempts.noise if number else 0.0).choices)
        for term, agent, asked in choices:
            if event := awaited(term):
                last = mission.steps if event.high is None else min(asked + event.high, mission.steps)
                choices[term, agent, asked] = max(
                    range(asked + event.low, last + 1),
                    key=lambda step: min((abs(step - each) for each in taken), default=0),
                )
        return choices | dict(witness)
