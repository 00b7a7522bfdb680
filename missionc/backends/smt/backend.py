"""SAT-based planning backend: roadmaps → clauses → solver and collision clauses, in rounds → trace.

    in   Mission, its kernel
    out  Planned, Impossible or NotFound

If a roadmap contains no plan, finer roadmaps are tried before the mission is reported infeasible on roadmaps.

Source:
    [strel] Algorithm 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

from missionc.backends.acceptance import violated_between_samples
from missionc.backends.api import Budget, Impossible, NotFound, Outcome, Planned, Progress, Reason, Turns, discard_plan
from missionc.backends.options import ROADMAP_PRESETS, Options
from missionc.backends.run_account import CLAUSE, CLAUSE_CONFLICT, QUESTION, run_to_end
from missionc.backends.smt.encode.clauses import Clauses, TooLarge
from missionc.backends.smt.encode.lower_motion import all_ways
from missionc.backends.smt.encode.metric_bounds import bounded_above, measured_goals, without_metres
from missionc.backends.smt.lift import lift
from missionc.backends.smt.paced_run import PacedRun, Pausing
from missionc.backends.smt.prioritized.prioritized_plan import PrioritizedPlan
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.refine.problem import Deletion, Problem, Setting, minimise
from missionc.backends.smt.roadmap.labels import Unexpressible
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, Roadmap, whole_moves
from missionc.backends.smt.roadmap.roadmap_graph import graphs_of
from missionc.backends.smt.roadmap.sequence import Attempt, is_linked, roadmaps_between_samples, roadmaps_to_try
from missionc.backends.smt.roadmap_answers import Inconclusive, NoPlan, TimeOver, TooFewLinks, WorkExceeded, refusal
from missionc.backends.smt.sat.installed_solvers import solver_missing
from missionc.backends.smt.sat.proof import certify
from missionc.backends.smt.sat.solve import Solvers, Stopped, Unsatisfiable
from missionc.backends.smt.sat.solver_process import is_over
from missionc.backends.smt.shorten.improve import improve
from missionc.backends.smt.spec import SMT
from missionc.backends.smt.subset_questions import SubsetQuestions, infeasible_alone
from missionc.backends.smt.undecided import FEW, nearest, under_way
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.signals import defer_stop, stop_requested
from missionc.base.trace import Flags, Solved, Trace
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Goal, Kernel
from missionc.ir.lower.hold_throughout import hold_throughout
from missionc.ir.wording import all_listed


@dataclass(slots=True)
class SmtBackend:
    """Backend that plans on roadmaps with a SAT solver (Z3 or CaDiCaL); collision clauses are added until a plan has no
    collisions."""

    name: str = "smt"
    refutes: bool = True

    def missing(self, options: Options) -> Diagnostic | None:
        """Finding if the required solver is missing; None otherwise."""
        return solver_missing(options)

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """Outcome of the search for a joint trajectory on roadmaps that satisfies every requirement."""
        return run_to_end(self.turns(mission, kernel, options, budget), budget)

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """Search in turns: one roadmap after the other, with clauses and conflicts within the granted work."""
        if options.preset in SMT.presets:
            from missionc.backends.smt.paper.paper_run import plan_as_published  # for callers that request them

            yield 0.0
            return plan_as_published(mission, kernel, budget, apart=options.preset != ROADMAP_PRESETS[0])
        return (yield from Run(mission, kernel, options, budget).turns())


BACKEND = SmtBackend()


@dataclass(slots=True)
class Run(PacedRun):
    tried: list[int] = field(default_factory=list)
    """Numbers of nodes of the roadmaps tried."""
    refused: list[int] = field(default_factory=list)
    """Numbers of nodes of the roadmaps that are proved to contain no plan."""
    conflicting: set[str] = field(default_factory=set)
    """Names of requirements that some refusal uses: they conflict on each of the refused roadmaps."""
    roadmaps: list[tuple[Roadmap, ...]] = field(default_factory=list)
    """Roadmaps proved to contain no plan: the roadmap of shortest paths, then sampled roadmaps, the finest last."""
    planner: PrioritizedPlanner | None = None
    """Prioritized planner on the last roadmap."""
    problem: Problem | None = None
    """SAT problem of all agents on the last roadmap, once it is encoded."""
    layer: str = ""
    """Description of the current stage; empty before the first roadmap."""
    given: Kernel = field(init=False)
    measured: frozenset[str] = field(init=False)
    """Names of goals about lengths in metres, which are rounded: a refusal that uses one of them proves nothing."""

    def __post_init__(self) -> None:
        self.given, self.kernel = self.kernel, bounded_above(self.kernel)
        self.measured = measured_goals(self.given.goals)

    def turns(self, attempts: Iterable[Attempt] | None = None) -> Turns:
        """Search in turns on the roadmaps of ``attempts``; None for all roadmaps."""
        if attempts is None:
            sampled = 1 if self.options.brief else None
            attempts = roadmaps_to_try(self.mission, self.kernel, self.budget.seed, sampled)
        try:
            return (yield from self.on_attempts(iter(attempts)))
        except TooLarge as error:
            return self.not_found(Reason.SIZE, f"{error}; the limit is {self.budget.limits.clauses}")
        except MemoryError as error:
            why = str(error) or "memory limit reached while encoding the mission"
            return self.not_found(Reason.MEMORY, why)
        except TimeOver:
            return self.not_found(Reason.TIME, "")

    def on_attempts(self, attempts: Iterator[Attempt]) -> Turns:
        yield from self.pause()
        refused: NoPlan | None = None
        missing, why = "", ""
        for attempt in attempts:
            granted = self.account.work + self.settings.work.shortest_paths
            self.most = math.inf if attempt.sampled else granted
            with self.solvers() as solvers:
                self.budget.on_progress(Progress("roadmap", attempt.number, f"{attempt.nodes} nodes"))
                what = f"a roadmap of {attempt.nodes} nodes" if attempt.sampled else "a roadmap of shortest paths"
                self.layer, self.planner, self.problem = f"building {what}", None, None
                with self.account.stage("roadmap"):
                    roadmaps = attempt.build()
                if isinstance(roadmaps, NoRoadmap):  # on these samples: a finer roadmap may contain a plan
                    missing = roadmaps.statement
                    continue
                if attempt.sampled:
                    self.tried.append(attempt.nodes)
                    self.account.sizes["nodes"] = attempt.nodes
                missing = ""
                result = yield from self.on_roadmaps(roadmaps, solvers)
            if isinstance(result, Planned):
                report = replace(result.report, roadmaps=graphs_of(self.mission, roadmaps))
                result = self.soonest(replace(result, report=report), attempts)
                return self.between_samples(result, roadmaps, [*attempts])
            if not isinstance(result, NoPlan | Inconclusive):
                return result
            why = result.why if isinstance(result, Inconclusive) else ""
            if isinstance(result, NoPlan):
                self.conflicting.update(result.conflict)
                self.roadmaps.insert(len(self.roadmaps) if attempt.sampled else 0, roadmaps)
            if not attempt.sampled or isinstance(result, Inconclusive):
                continue  # samples have more nodes, and the answer is about them
            refused = result
            self.refused.append(attempt.nodes)
        if missing or not self.tried:
            return self.not_found(Reason.NO_ROADMAP, missing)
        if refused is None or len(self.refused) < len(self.tried):
            return self.not_found(Reason.SOLVER, why or "no plan was found with rounded lengths")
        deletion, refused = self.smallest(refused)
        if self.options.certify:
            certify(refused.clauses, refused.core, self.budget, self.account)
        flown = any(roadmap.flown for roadmaps in self.roadmaps for roadmap in roadmaps)
        statement = refusal(deletion.conflict, self.tried, self.mission.solve.roadmap, flown)
        return Impossible(deletion.conflict, statement, self.account.report(), smallest=deletion.smallest)

    def soonest(self, planned: Planned, others: Iterator[Attempt]) -> Planned:
        """Plan of least duration on this roadmap and others, within as much work as the given plan took."""
        if self.mission.objective is not Objective.DURATION or self.kernel.preferences or self.options.brief:
            return planned
        left, tried = max(self.settings.work.sooner, self.account.work), 1
        for attempt in others:
            lasts = planned.trace.lasts
            if (
                left <= 0
                or self.budget.lower_bound(lasts) >= lasts
                or is_over(self.budget.deadline)
                or stop_requested()
            ):
                break
            defer_stop()
            self.budget.on_incumbent(planned)
            self.budget.on_progress(Progress("improve", tried, f"{lasts} steps so far, trying another roadmap"))
            budget = replace(self.budget, work=left, on_incumbent=discard_plan)
            run = Run(self.mission, self.given, replace(self.options, brief=True), budget)
            other = run_to_end(run.turns((attempt,)), budget)
            left -= other.report.work
            tried += 1
            self.account.spend(other.report)
            if isinstance(other, Planned) and other.trace.lasts < lasts:
                found = other.report
                report = replace(planned.report, notes=found.notes, roadmaps=found.roadmaps, solved=found.solved)
                planned = replace(other, report=report)
        spent = self.account.report()
        notes = (*planned.report.notes, *([f"shortest of the plans on {tried} roadmaps"] if tried > 1 else []))
        return replace(planned, report=replace(planned.report, seconds=spent.seconds, work=spent.work, notes=notes))

    def between_samples(self, planned: Planned, roadmaps: tuple[Roadmap, ...], others: list[Attempt]) -> Planned:
        """Plan whose requirements hold between samples too, if one is found; else the same plan.

        Requirements that fail between samples are strengthened. No refusal of a strengthened one proves anything. Of
        plans that satisfy them while agents move straight, one whose flight does is preferred.

        Args:
            roadmaps: those of the plan; ``others`` have not been tried.
        """
        quick = self.budget.urgent or self.options.brief or self.options.certify or self.options.captures
        violated_in_flight = self.budget.violated_in_flight
        if violated_in_flight is None or quick or self.mission.steps == 0:
            return planned
        names = violated_between_samples(self.mission, self.given, planned.trace)
        if not names:
            return planned
        settings, found = self.settings.work, list[Planned]()
        left = max(settings.between_samples, settings.between_samples_share * self.account.work)
        defer_stop()
        self.budget.on_incumbent(planned)
        for number in range(settings.between_samples_plans):
            self.budget.on_progress(Progress("improve", number, f"{all_listed(sorted(names))} between samples"))
            stronger = hold_throughout(self.mission, self.given, names, motions=True)
            budget = replace(self.budget, work=left, on_incumbent=discard_plan, violated_in_flight=None)
            run = Run(self.mission, stronger, replace(self.options, brief=True), budget)
            attempts = roadmaps_between_samples(self.mission, self.given, self.budget.seed + number, roadmaps)
            other = run_to_end(run.turns((*attempts, *others)), budget)
            left -= other.report.work
            self.account.spend(other.report)
            if not isinstance(other, Planned):
                break
            failing = violated_between_samples(self.mission, self.given, other.trace)
            if not failing:
                held = not violated_in_flight(other.trace)
                found = [other] if held else [*found, other]
                if held or not is_linked(self.given):  # other seeds give other relays only
                    break
            elif failing <= names:
                break
            names |= failing
            if left <= 0 or is_over(self.budget.deadline) or stop_requested():
                break
        if not found:
            return self.with_effort(planned)
        strengthened = all_listed([f"`{name}`" for name in sorted(names)])
        return self.with_effort(found[0]).noting(f"planned with {strengthened} strengthened between samples")

    def with_effort(self, planned: Planned) -> Planned:
        """The plan with the seconds and the work of the whole run."""
        spent = self.account.report()
        return replace(planned, report=replace(planned.report, seconds=spent.seconds, work=spent.work))

    def smallest(self, refused: NoPlan) -> tuple[Deletion, NoPlan]:
        """Smallest conflict found within the work, and its refusal by the last roadmap."""
        conflict = tuple(goal.name for goal in self.given.requirements if goal.name in self.conflicting)
        if self.options.brief:
            return Deletion(conflict), refused
        with self.solvers() as solvers:
            questions = SubsetQuestions(
                self.mission,
                self.kernel,
                self.measured,
                self.roadmaps,
                self.budget,
                self.account,
                solvers,
                self.options.certify or self.options.require_solver,
            )
            return questions.smallest(conflict, refused)

    def on_roadmaps(self, roadmaps: tuple[Roadmap, ...], solvers: Solvers) -> Pausing[Outcome | NoPlan | Inconclusive]:
        self.account.sizes["states"] = sum(len(roadmap.position) for roadmap in roadmaps)
        alone = self.refused_alone(roadmaps, solvers)
        if alone is not None:
            return alone
        try:
            few = yield from self.prioritized(roadmaps, solvers)
            return few if few is not None else (yield from self.with_all_links(roadmaps, solvers))
        except WorkExceeded:
            return Inconclusive()
        except Unexpressible as error:
            return Inconclusive(f"the solver cannot express {error}")

    def refused_alone(self, roadmaps: tuple[Roadmap, ...], solvers: Solvers) -> NoPlan | None:
        """Refusal of one requirement by single-agent analysis; None without a refusal, or if clauses are requested."""
        if self.options.certify or self.options.captures or self.options.require_solver:
            return None
        goals = [goal for goal in self.kernel.requirements if goal.name not in self.measured]
        names = infeasible_alone(goals, self.mission, roadmaps, self.account)
        if not names:
            return None
        self.record(None, 0, solvers)
        return NoPlan((next((name for name in names if name in self.conflicting), names[0]),), Clauses(1), ())

    def with_all_links(
        self, roadmaps: tuple[Roadmap, ...], solvers: Solvers
    ) -> Pausing[Outcome | NoPlan | Inconclusive]:
        """Outcome of one SAT problem with all agents, first with short routes, then with all links."""
        ways = all_ways(roadmaps, {})
        refused = (yield from self.without_metres(roadmaps, ways, solvers)) if self.measured else None
        if refused is not None:
            return refused
        for most_links in (self.settings.solver.links, len(self.mission.agents)):
            if not solvers.alive:
                solvers = self.solvers()
            with solvers:
                result = yield from self.with_everyone(roadmaps, ways, most_links, solvers)
            if not isinstance(result, TooFewLinks):
                break
        assert not isinstance(result, TooFewLinks)
        return result

    def without_metres(
        self, roadmaps: tuple[Roadmap, ...], ways: tuple[Flags, ...], solvers: Solvers
    ) -> Pausing[NoPlan | None]:
        """Refusal of consequences of the requirements without metres, within the work of a turn; None without a
        refusal."""
        requirements, agents = without_metres(self.given).requirements, range(len(self.mission.agents))

        def build(setting: Setting) -> Problem:
            return setting.problem(requirements, roadmaps, ways, frozenset(agents), frozenset(), len(agents), solvers)

        problem = yield from self.within_clauses(build)
        search, asked = problem.search, problem.lowered.goals
        result = search.find(asked, self.effort(search))
        if not isinstance(result, Unsatisfiable):
            return None
        core = self.smaller(result.core, requirements, asked, search)
        self.record(problem, search.rounds, solvers)
        conflict = tuple(goal.name for goal, literal in zip(requirements, asked, strict=True) if literal in core)
        return NoPlan(conflict, search.clauses, core)

    def smaller(
        self, core: tuple[int, ...], requirements: tuple[Goal, ...], asked: tuple[int, ...], search: LazyConstraints
    ) -> tuple[int, ...]:
        """Core reduced by deletion, as literals.

        Literals that are in no conflict so far are deleted first, so that the roadmaps agree on one conflict.
        """
        if self.options.brief:
            return core
        pairs = zip(requirements, asked, strict=True)
        known = {literal for goal, literal in pairs if goal.name in self.conflicting}
        with self.account.stage("core"):
            return minimise(tuple(sorted(core, key=known.__contains__)), search)

    def prioritized(self, roadmaps: tuple[Roadmap, ...], solvers: Solvers) -> Pausing[Planned | NoPlan | None]:
        """Plan or refusal by prioritized planning: first within a turn's work, then within the limit; None without
        either."""
        mission, kernel, settings = self.mission, self.kernel, self.settings
        solved = CLAUSE + 2 * QUESTION + 3000 * CLAUSE_CONFLICT  # per clause: build, simplify and solve
        better = bool(kernel.preferences) or mission.objective is not Objective.NONE
        small = whole_moves(roadmaps) < settings.solver.all_agents
        if self.options.require_solver or mission.steps == 0 or (better and small):
            return None
        self.layer = FEW
        least = settings.work.first_each * len(mission.agents)
        most = max(settings.work.prioritized, settings.work.prioritized_each * len(mission.agents))
        while True:
            share = min(most, max(least, self.granted - self.account.work))
            attempt = partial(self.few_at_a_time, roadmaps, solvers, share, most)
            plan, trace = yield from self.within_clauses(attempt, solved)
            if trace is not None or plan.refused is not None or plan.affordable or share == most:
                break
            least = settings.work.growth * share
            yield from self.pause(least)
        self.planner = plan.planner
        if trace is not None and plan.planner is not None:
            self.account.sizes["turns"] = plan.planner.taken
            self.record(plan.planner.largest, plan.planner.rounds, solvers)
            return Planned(trace, self.account.report())
        if plan.refused is not None and not self.options.certify and not self.options.captures:
            self.record(None, 0, solvers)
            return NoPlan(plan.refused, Clauses(1), ())
        if not plan.affordable:
            self.account.notes.append("prioritized planning found no plan within its share of the work")
        return None

    def few_at_a_time(
        self, roadmaps: tuple[Roadmap, ...], solvers: Solvers, share: float, most: float, setting: Setting
    ) -> tuple[PrioritizedPlan, Trace | None]:
        """Result of one attempt at prioritized planning with ``share`` work units, and up to ``most`` for
        improvements."""
        done = self.account.work
        plan = PrioritizedPlan(setting, self.kernel, roadmaps, solvers, done + share, done + most)
        return plan, plan.find()

    def with_everyone(
        self, roadmaps: tuple[Roadmap, ...], ways: tuple[Flags, ...], most_links: int, solvers: Solvers
    ) -> Pausing[Outcome | NoPlan | Inconclusive | TooFewLinks]:
        """Outcome of one SAT problem with all agents.

        Args:
            ways: possible states of each agent, (steps + 1, states).
            most_links: maximum number of links of a route.
        """
        kernel, account = self.kernel, self.account
        everyone = frozenset(range(len(self.mission.agents)))
        self.budget.on_progress(Progress("lower", max(len(self.tried), 1), f"{len(everyone)} agents"))
        goals = kernel.goals
        self.layer = "encoding the requirements of all agents"

        def build(setting: Setting) -> Problem:
            return setting.problem(goals, roadmaps, ways, everyone, frozenset(), most_links, solvers)

        problem = yield from self.within_clauses(build)
        self.problem, self.layer = problem, "solving"
        search, lowered = problem.search, problem.lowered
        search.proves = not self.measured
        required = lowered.goals[: len(kernel.requirements)]
        core: tuple[int, ...] = ()
        self.budget.on_progress(Progress("solve"))
        result = search.find(required, self.effort(search))
        while isinstance(result, Stopped) and result.paused:
            if self.account.work >= self.most:
                self.record(problem, search.rounds, solvers)
                return Inconclusive()
            yield from self.pause()
            solvers.relieve()
            result = search.find(required, self.effort(search))
        if isinstance(result, JointMotion):
            account.solved = (Solved(solvers.answered, self.mission.names),)
            if kernel.preferences or self.mission.objective is not Objective.NONE:
                defer_stop()
                self.budget.on_incumbent(
                    Planned(lift(result.states, problem.motion.own_roadmaps, self.mission), account.report())
                )
            result = improve(result, kernel, lowered.goals, search, self.budget.lower_bound)
            account.solved = (Solved(solvers.answered, self.mission.names),)
            if solvers.cut:
                account.cut()
        elif isinstance(result, Unsatisfiable) and not lowered.shortened:
            core = self.smaller(result.core, kernel.requirements, required, search)
        self.record(problem, search.rounds, solvers)
        match result:
            case JointMotion(states):
                return Planned(lift(states, problem.motion.own_roadmaps, self.mission), account.report())
            case Unsatisfiable() if lowered.shortened:
                return TooFewLinks()
            case Unsatisfiable():
                pairs = zip(kernel.requirements, required, strict=True)
                conflict = tuple(goal.name for goal, literal in pairs if literal in core)
                return (
                    Inconclusive() if self.measured.intersection(conflict) else NoPlan(conflict, search.clauses, core)
                )
            case Stopped(reason, detail):
                return self.not_found(reason, detail)

    def not_found(self, reason: Reason, detail: str) -> NotFound:
        refused = f"roadmaps of {all_listed([*map(str, self.refused)])} nodes contain no plan" if self.refused else ""
        way = "" if reason is Reason.NO_ROADMAP else under_way(self.mission, self.layer, self.planner, self.problem)
        ended = f"the search ended while {way}" if way else ""
        statement = "; ".join(filter(None, (detail, ended, refused))) or reason.value
        best = nearest(self.mission, self.given, self.planner, self.problem)
        return NotFound(reason, statement, self.account.report(), best)
