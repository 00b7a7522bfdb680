"""The hybrid backend, top to bottom: Z3 on a roadmap for the discrete part → witness → polish → a trace.

    in   Mission, its kernel
    out  Planned or NotFound

Z3 says which robots relay over which links and when; its motion is where the polish starts,
and its choices are kept for the requirements that a roadmap can judge. Other plans of Z3's follow where one
leads nowhere, and now and then a sketch of the transport's own. That a roadmap holds no plan says
nothing about the world between its nodes, so that "impossible" is not this backend's to say.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from missionc.backends.api import (
    Budget,
    Impossible,
    NotFound,
    Outcome,
    Planned,
    Turns,
    forget,
    ignore,
    open_ended,
    unheard,
)
from missionc.backends.clot.backend import ATTEMPTS
from missionc.backends.clot.backend import Run as Smooth
from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.optimise.goal_terms import Demand
from missionc.backends.clot.run.begin import NOISE
from missionc.backends.clot.run.run_state import Reached
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.torch_device import device_missing, enough_memory, one_thread
from missionc.backends.hybrid.discrete_relaxation import Discrete, discrete
from missionc.backends.hybrid.resample import on_clock, positions
from missionc.backends.options import Options
from missionc.backends.smt import backend as smt
from missionc.backends.smt.sat.installed_solvers import solver_missing
from missionc.backends.work import driven
from missionc.base.solved import Solved, then_polished
from missionc.base.trace import Array
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.kernel.walk import awaited

OWN = 3
"""Every so many-th first motion is the transport's own sketch, while Z3 finds others."""

TICKS = 30
"""A mission of more steps is asked of the roadmap on a coarser clock, of so many."""

DISCRETE = 20.0
"""The units of work that may go into one plan of Z3's."""


@dataclass(slots=True)
class HybridBackend:
    """Z3 for what is counted, transport and polish for what is measured."""

    name: str = "hybrid"
    refutes: bool = False

    def missing(self, options: Options) -> Diagnostic | None:
        """What to say where the solver or the device asked for is not there."""
        return solver_missing(options) or device_missing(options)

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """A joint motion that satisfies every requirement."""
        return driven(self.turns(mission, kernel, options, budget), budget)

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """The same in turns, of whole attempts."""
        yield 0.0
        with one_thread(), enough_memory():
            return (yield from Run(mission, kernel, options, budget).turns())


BACKEND = HybridBackend()


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """A first motion, (agents, steps + 1, dim), metres, and what it decides."""

    position: Array
    choices: Choices
    solved: tuple[Solved, ...]


@dataclass(slots=True)
class Run:
    mission: Mission
    kernel: Kernel
    options: Options
    budget: Budget
    smooth: Smooth = field(init=False)
    asked: Discrete = field(init=False)
    on_roadmap: Mission = field(init=False)

    @property
    def refused(self) -> str:
        """Why Z3 is asked no more; empty while it is."""
        return self.smooth.beside.get("refused", "")

    @refused.setter
    def refused(self, why: str) -> None:
        self.smooth.beside["refused"] = why

    def __post_init__(self) -> None:
        self.smooth = Smooth(self.mission, self.kernel, self.options, self.budget)
        ticks = min(self.mission.steps, TICKS)
        self.asked = discrete(self.kernel, self.mission.steps, ticks)
        self.on_roadmap = on_clock(self.mission, ticks)
        if not self.asked.kernel.requirements:
            self.refused = "no requirement is one for a roadmap"

    def turns(self) -> Turns:
        outcome = yield from self.smooth.turns(self.attempt)
        if not isinstance(outcome, NotFound):
            return outcome
        return replace(outcome, statement="; ".join(part for part in (outcome.statement, self.refused) if part))

    def attempt(self, number: int) -> Reached | None:
        start = None if self.refused or number % OWN == OWN - 1 else self.start(number)
        if start is None:
            return self.smooth.attempt(number)
        reached = self.smooth.polished(start.position, start.choices, number)
        if reached is None:
            return None
        return replace(reached, solved=then_polished(start.solved, self.mission.names))

    def start(self, number: int) -> Start | None:
        """A plan of Z3's for what is discrete, with the choices it makes, if there is one."""
        account, budget = self.smooth.account, self.budget
        self.smooth.tell("discrete", number)
        seed = budget.seed * ATTEMPTS + number
        with account.stage("discrete"):
            asked = replace(
                budget,
                seed=seed,
                listen=ignore,
                found=unheard,
                enough=open_ended,
                keep=forget,
                resume=None,
                work=DISCRETE,
            )
            options = Options(solver=self.options.solver, require_solver=self.options.require_solver)
            outcome = smt.BACKEND.plan(self.on_roadmap, self.asked.kernel, options, asked)
            account.work += outcome.report.work
        match outcome:
            case Planned(trace, report):
                account.sizes |= {name: size for name, size in report.sizes if name in ("nodes", "clauses")}
            case Impossible(_, statement) | NotFound(_, statement):
                self.refused = statement
                account.notes.append(f"the discrete part was left to the transport: {statement}")
                return None
        with account.stage("witness"):
            first = positions(self.mission, trace)
            return Start(first, self.decided(first, number), report.solved)

    def decided(self, first: Array, number: int) -> Choices:
        """Z3's choices where nothing is measured; elsewhere a schedule's, at times far from Z3's own.

        Args:
            first: its motion, (agents, steps + 1, dim), metres.
        """
        mission = self.mission
        made = splines(mission)
        roots = tuple(each.formula for each in self.smooth.graph.requirements if each.name in self.asked.whole)
        witness = Demand.of(mission, roots, {}, mission.steps).witness(*made.states(made.through(first)))
        taken = [step for (term, _, _), step in witness.items() if awaited(term)]
        scheduler = Scheduler(
            mission, self.smooth.asked, self.smooth.geodesics, np.random.default_rng([self.budget.seed, number])
        )
        choices = dict(scheduler.schedule(NOISE if number else 0.0).choices)
        for term, agent, asked in choices:
            if event := awaited(term):
                last = mission.steps if event.high is None else min(asked + event.high, mission.steps)
                choices[term, agent, asked] = max(
                    range(asked + event.low, last + 1),
                    key=lambda step: min((abs(step - each) for each in taken), default=0),
                )
        return choices | dict(witness)
