"""Trajectory optimisation backend: cost graph → schedule → joint waypoints → initial trajectory → local optimisation →
trace.

    in   Mission, its kernel
    out  Planned or NotFound

A preset may insert Algorithms 1 and 2 before the local optimisation (*polish*), or replace it by them (``presets``).

If one schedule leads to no plan, further schedules follow with other disjuncts, orders and paths. After every few
schedules, a search from the best schedule plans agents one by one (``run_algorithm_2``). All attempts follow from the
seed; several may run in parallel (``parallel_attempts``). This backend never reports infeasibility.

Source:
    [clot] Problem 1.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec

import numpy as np

from missionc.backends.acceptance import attempt
from missionc.backends.api import (
    Attempt,
    Budget,
    NotFound,
    Outcome,
    Planned,
    Progress,
    Reason,
    Turns,
    UnusableSnapshot,
    discard_snapshot,
)
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.cost_weights import spare
from missionc.backends.clot.optimise.active_set import Choices, Demand
from missionc.backends.clot.optimise.control_points import control_after, splines, trace
from missionc.backends.clot.optimise.improve import improve
from missionc.backends.clot.optimise.levenberg_marquardt import Polished, polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.own_state_stays import with_stays
from missionc.backends.clot.run.initial_guesses import InitialGuesses
from missionc.backends.clot.run.parallel_attempts import run_parallel_attempts
from missionc.backends.clot.run.presets import PRESETS, Preset, fewer_samples, preset
from missionc.backends.clot.run.run_state import (
    Nearest,
    Reached,
    RunCandidate,
    Searched,
    Searching,
    State,
    failure_statement,
    freed,
    from_snapshot,
    near,
    to_snapshot,
)
from missionc.backends.clot.schedule.draft import WarmStart
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.tasks import Outline, outline
from missionc.backends.clot.settings import clot_settings
from missionc.backends.clot.spec import CLOT
from missionc.backends.options import DEVICES, Options
from missionc.backends.run_account import SEARCH, Account, polish_work, run_to_end, sketch_work
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.signals import defer_stop, stop_requested
from missionc.base.trace import SKETCH, TRANSPORT, Array, Solved, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.walk import postorder


@dataclass(slots=True)
class ClotBackend:
    """Backend that optimises smooth joint trajectories; it never reports infeasibility."""

    name: str = "clot"
    refutes: bool = False

    def missing(self, options: Options) -> Diagnostic | None:
        """Finding if the requested device is missing; None otherwise."""
        return device_missing(options)

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """Outcome of the search for a joint trajectory that satisfies every requirement."""
        return run_to_end(self.turns(mission, kernel, options, budget), budget)

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """Search in turns, each of which consists of complete attempts."""
        yield 0.0
        return (yield from TransportRun(mission, kernel, options, budget).turns())


def device_missing(options: Options) -> Diagnostic | None:
    """Diagnostic if the selected device is missing; every computer has a CPU."""
    if options.device == DEVICES[0]:
        return None
    from missionc.backends.clot.paper import torch_device  # loads torch

    return torch_device.device_missing(options)


BACKEND = ClotBackend()


@dataclass(slots=True)
class TransportRun:
    mission: Mission
    kernel: Kernel
    options: Options
    budget: Budget
    account: Account = field(default_factory=Account)
    late: bool = False
    """True if a stage ended because the time limit was reached."""
    best: RunCandidate | None = None
    furthest: Searched | None = None
    """Result of the search that planned the most agents without a joint trajectory."""
    beside: dict[str, str] = field(default_factory=dict)
    """Texts of the caller that the checkpoint must contain, by name."""
    first: int = 0
    """Index of the first attempt."""
    search: Searching | None = None
    reached: Reached | None = None
    """Plan of the interrupted attempt, if it had one when the run was interrupted."""
    work_before: float = 0.0
    """Work units before the current attempt, which is repeated if its search is resumed."""
    spare: tuple[int, Reached] | None = None
    """Plan found before an earlier attempt ended, with its attempt index; used if time runs out."""
    preset: Preset = field(init=False)
    graph: Kernel = field(init=False)
    asked: Outline = field(init=False)
    geodesics: Geodesics = field(init=False)
    beginnings: InitialGuesses = field(init=False)

    @property
    def agent_steps(self) -> int:
        """Number of agents times number of steps."""
        return len(self.mission.agents) * self.mission.steps

    def __post_init__(self) -> None:
        self.preset = preset(self.options.preset, self.options.samples, self.options.device).tuned(self.mission)
        with self.account.stage("lower"):
            self.graph = build(self.kernel)
            self.asked = outline(self.graph, self.mission.steps)
            self.geodesics = Geodesics(self.mission)
            self.beginnings = InitialGuesses(
                self.mission, self.kernel, self.graph, self.asked, self.geodesics, self.in_time, self.sketched
            )
        self.account.sizes["terms"] = len(postorder(self.graph.formulas))
        if self.budget.resume is not None:
            self.take_up(from_snapshot(self.budget.resume, self.mission, self.graph))
        fewer = fewer_samples(self.preset, self.options.samples, self.options.device)
        if fewer and fewer not in self.account.notes:
            self.account.notes.append(fewer)

    def turns(self, attempt: Callable[[int], Reached | None] | None = None) -> Turns:
        """Outcome of the first attempt that finds a plan; the generator pauses after each attempt.

        Args:
            attempt: function that makes the attempt with an index; None for this backend's own method.
        """
        attempt, number = attempt or self.attempt, self.first
        while number < clot_settings(self.mission).attempts.schedules:
            if not self.in_time():
                return self.not_found(Reason.TIME) if self.spare is None else self.planned(*self.spare)
            if self.search is None and self.reached is None:
                self.keep(number)
            alike = self.alike(number)
            if len(alike) > 1:
                number, reached = yield from run_parallel_attempts(self, alike, attempt)
            else:
                self.account.sizes["attempts"] = number + 1
                self.work_before = self.account.work
                reached = self.taken_up() or attempt(number)
                number = number if reached else number + 1
            if reached is not None:
                return self.planned(number, reached)
            if len(alike) == 1:
                yield self.account.work
        return self.not_found(Reason.SOLVER)

    def alike(self, number: int) -> range:
        """Indices of the attempts from ``number`` on that do not depend on each other."""
        settings = clot_settings(self.mission).attempts
        if self.options.processes == 1 or self.preset.local or self.search is not None or self.reached is not None:
            return range(number, number + 1)
        until_search = settings.search_every - 1 - number % settings.search_every
        return range(number, min(settings.schedules, number + max(1, until_search)))

    def planned(self, number: int, reached: Reached) -> Planned:
        self.account.solved = reached.solved
        made = self.improved(reached, number)
        if self.late:
            self.account.cut()
        return Planned(made, self.account.report())

    def attempt(self, number: int) -> Reached | None:
        """Plan of the attempt with one schedule; None if it finds none."""
        settings = clot_settings(self.mission).attempts
        way = self.preset
        generator = np.random.default_rng([self.budget.seed, number])
        resumed, self.search = self.search, None
        self.tell("sketch", number)
        before = None if self.best is None else self.best.nearest
        if (
            before is not None
            and before.sketch is not None
            and not way.local
            and number % settings.search_every == settings.search_every - 1
            and self.can_search()
        ):
            way, begun = PRESETS["search"].tuned(self.mission), self.again(before.sketch, before.motion)
        else:
            begun = self.begun(number, generator)
        motions: tuple[Array, ...] = (begun.motion,)
        if way.local:
            motions = self.searched(way, begun, generator, number, resumed)
        for motion in motions:
            reached = self.polished(motion, begun.schedule.choices, number, way, replace(begun, motion=motion))
            if reached is not None:
                return replace(reached, solved=(Solved(TRANSPORT if way.local else SKETCH, self.mission.names),))
        return None

    def can_search(self) -> bool:
        """Return whether the package of Algorithm 2 is installed; otherwise note it."""
        if find_spec(CLOT.package) is not None:
            return True
        note = f"no attempt searched: Algorithm 2 needs `pip install 'missionc[{CLOT.extra}]'`"
        if note not in self.account.notes:
            self.account.notes.append(note)
        return False

    def searched(
        self, way: Preset, begun: WarmStart, generator: np.random.Generator, number: int, resumed: Searching | None
    ) -> tuple[Array, ...]:
        """Joint trajectories that Algorithm 2 finds, (agents, steps + 1, dim) each, metres; the search's progress is
        saved."""
        from missionc.backends.clot.paper.run_algorithm_2 import run_algorithm_2  # loads torch

        with self.account.stage("search"):
            search = run_algorithm_2(
                self.mission,
                self.kernel,
                self.graph,
                way,
                begun,
                self.geodesics,
                generator,
                self.budget,
                self.in_time,
                number + 1,
                self.options.device,
                self.options.processes,
                partial(self.keep, number),
                resumed,
            )
        self.account.work += SEARCH * sketch_work(self.agent_steps)
        self.account.sizes |= search.sizes
        if not search.motions and (self.furthest is None or search.rank > self.furthest.rank):
            self.furthest = search
        return search.motions

    def polished(
        self, first: Array, choices: Choices, number: int, way: Preset | None = None, begun: WarmStart | None = None
    ) -> Reached | None:
        """Plan from local optimisation of an initial trajectory, (agents, steps + 1, dim), metres; None if the result
        is no plan.

        Args:
            way: preset, which may skip the local optimisation.
            begun: warm start that produced the trajectory, if another search may use it.
        """
        # A nearly feasible motion is polished again with these multiples of the usual clearance.
        clearances = (1.0, 3.0, 9.0)
        mission = self.mission
        made = splines(mission)
        control = control_after(mission, made, first)
        if way is not None and not way.polished:
            plan = self.judged(Polished(control, 0.0, "a check", 0.0, 0), trace(mission, made, control), begun)
            return None if plan is None else Reached(control, choices, final=True)
        for more in clearances:
            with self.account.stage("polish"):
                demand, costs = self.wanted(choices, first, more)
                told = partial(self.tell, "polish", number)
                iterations = clot_settings(mission).attempts.polish
                polished = polish(control, costs, demand, iterations, self.in_time, told)
            self.account.work += polish_work(self.mission, polished.iterations)
            self.account.sizes["iterations"] = self.account.sizes.get("iterations", 0) + polished.iterations
            plan = self.judged(polished, trace(mission, made, polished.control), begun)
            if plan is not None:
                return Reached(polished.control, choices)
            if polished.shortfall > near(mission):
                return None
            control = polished.control
            choices = freed(choices, self.graph, attempt(mission, self.kernel, trace(mission, made, control)))
        return None

    def improved(self, reached: Reached, number: int) -> Trace:
        """Trace of a plan after improvement by preferences and objective."""
        control = reached.control
        made = trace(self.mission, splines(self.mission), control)
        if reached.final:
            return made
        defer_stop()
        self.budget.on_incumbent(Planned(made, self.account.report()))
        self.keep(number, reached=reached)
        self.tell("improve", number)
        with self.account.stage("improve"):
            wanted, enough = self.wanted(reached.choices, made.position), self.budget.lower_bound
            better = improve(
                control, made, self.mission, self.kernel, self.graph, *wanted, self.accepted, self.in_time, enough
            )
        self.account.notes.extend(better.notes)
        return better.trace

    def wanted(self, choices: Choices, first: Array, more: float = 1.0) -> tuple[Demand, Costs]:
        """Conditions on a trajectory, and its costs.

        Args:
            first: initial trajectory, (agents, steps + 1, dim), metres.
            more: factor on the usual additional clearance.
        """
        roots = tuple(wanted.formula for wanted in self.graph.requirements)
        made = splines(self.mission)
        demand = Demand.of(self.mission, roots, choices, self.mission.steps)
        demand = with_stays(demand, *made.states(made.through(first)))
        room = spare(self.mission)
        roomier = replace(room, bodies=more * room.bodies)
        return demand, Costs(self.mission, made, clot_settings(self.mission).weights, roomier)

    def accepted(self, control: Array) -> Trace | None:
        """Trace of control points, (agents, points, dim), metres, if it is a plan; None otherwise."""
        made = trace(self.mission, splines(self.mission), control)
        return made if attempt(self.mission, self.kernel, made).is_plan else None

    def judged(self, polished: Polished, made: Trace, begun: WarmStart | None) -> Trace | None:
        """Trace if it is a plan; otherwise None, and the candidate is recorded if it is the best so far."""
        with self.account.stage("accept"):
            come_to = attempt(self.mission, self.kernel, made)
        if come_to.is_plan:
            return made
        came_of = (None, None) if begun is None else (begun.number, begun.motion)
        self.consider(Nearest(polished.control, polished.shortfall, *came_of), come_to)
        return None

    def consider(self, nearest: Nearest, come_to: Attempt) -> None:
        """Record a candidate unless an earlier candidate was better."""
        candidate = RunCandidate(nearest, come_to)
        if self.best is None or candidate.rank < self.best.rank:
            self.best = candidate

    def begun(self, number: int, generator: np.random.Generator) -> WarmStart:
        """Schedule, joint waypoints and initial trajectory of an attempt.

        Args:
            generator: random generator of the attempt, not used before.
        """
        with self.account.stage("sketch"):
            return self.beginnings.begun(number, generator)

    def sketched(self) -> None:
        """Add the work of one initial trajectory to the account."""
        self.account.work += sketch_work(self.agent_steps)

    def again(self, number: int, motion: Array | None) -> WarmStart:
        """Warm start of an attempt with another initial trajectory, (agents, steps + 1, dim), metres."""
        begun = self.begun(number, np.random.default_rng([self.budget.seed, number]))
        return begun if motion is None else replace(begun, motion=motion)

    def keep(self, number: int, search: Searching | None = None, reached: Reached | None = None) -> None:
        """Save a checkpoint, unless a stage has been cut short since the last checkpoint."""
        if self.late or self.budget.on_snapshot is discard_snapshot:
            return
        nearest = None if self.best is None else self.best.nearest
        far = None if self.furthest is None else self.furthest.rank
        work = self.account.work if search is None else self.work_before
        state = State(number, nearest, far, tuple(self.account.notes), work, self.beside, search, reached)
        self.budget.on_snapshot(to_snapshot(state, self.graph))

    def take_up(self, state: State) -> None:
        """Restore the state of an interrupted run."""
        self.first, self.search, self.reached = state.number, state.search, state.reached
        self.account.notes.extend(state.notes)
        self.account.work = state.work
        self.beside.update(state.beside)
        if state.furthest is not None:
            self.furthest = Searched((), *state.furthest)
        if state.nearest is not None:
            made = trace(self.mission, splines(self.mission), state.nearest.control)
            self.best = RunCandidate(state.nearest, attempt(self.mission, self.kernel, made))

    def taken_up(self) -> Reached | None:
        """Plan of the interrupted run; None if the run had no plan.

        Raises:
            UnusableSnapshot: the saved control points are no plan.
        """
        reached, self.reached = self.reached, None
        if reached is not None and self.accepted(reached.control) is None:
            raise UnusableSnapshot("the plan in the checkpoint is invalid")
        return reached

    def in_time(self) -> bool:
        """Return true if time is left and no signal arrived."""
        self.late = self.late or time.monotonic() >= self.budget.deadline or stop_requested()
        return not self.late

    def tell(self, stage: str, number: int, iteration: int = 0, margin: float = -np.inf) -> None:
        """Report progress.

        Args:
            margin: worst margin of the current candidate, metres.
        """
        best = max(margin, -np.inf if self.best is None else -self.best.nearest.shortfall)
        margin_so_far = None if best == -np.inf else best
        self.budget.on_progress(Progress(stage, number + 1, iteration=iteration, margin=margin_so_far))

    def not_found(self, reason: Reason) -> NotFound:
        best = None if self.best is None else self.best.attempt
        return NotFound(reason, failure_statement(best, self.furthest, self.mission), self.account.report(), best)
