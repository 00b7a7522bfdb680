"""Portfolio backend: its engines take turns of growing length, and the first plan is the answer.

    in   Mission, its kernel
    out  Planned, Impossible or NotFound

The turns depend on the work of each engine, never on seconds. A refusal by roadmaps ends only that engine: the others
have some more turns, and if they find nothing, the refusal is the answer.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace

from missionc.backends import api
from missionc.backends.options import Options
from missionc.backends.run_account import run_to_end
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import counted
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

FIRST, LONGER = 4.0, 2.0
"""Work units of each engine after its first turn, and the factor for each further turn."""

ATTEMPTS, TIMES = 3, 2.0
"""After a refusal by roadmaps: attempts of each other engine, and its work as a multiple of the refusal's work. An
engine that repeats another's attempts has only its first turn, and none after a refusal."""

WORST = (api.Reason.TIME, api.Reason.MEMORY, api.Reason.SIZE, api.Reason.SOLVER, api.Reason.NO_ROADMAP)
"""Reasons for ending without an answer, in order of precedence in the portfolio's report."""


class Engine(Record):
    """Backend in a portfolio: its name, its loader, and whether it repeats the attempts of another engine."""

    name: str
    load: Callable[[], api.Backend]
    repeats: bool = False


@dataclass(slots=True)
class PortfolioBackend:
    """Several engines in turns.

    Args:
        engines: in the order of their turns. Each is loaded at its first turn, so that unused ones cost nothing.
    """

    engines: Sequence[Engine]
    name: str = "auto"
    refutes: bool = False

    def missing(self, options: Options) -> Diagnostic | None:
        """None, since engines that are not installed have been omitted."""
        return None

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget) -> api.Outcome:
        """First plan that an engine finds, or the combined answer of all engines."""
        return run_to_end(self.turns(mission, kernel, options, budget), budget)

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget) -> api.Turns:
        """Search in turns of the engines."""
        with ExitStack() as stack:
            runs = [Run(each, mission, kernel, options, budget) for each in self.engines]
            for run in runs:
                stack.enter_context(closing(run))
            return (yield from in_turns(runs))


@dataclass(slots=True, eq=False)
class Run:
    """Search of one engine, from its first turn to its last."""

    engine: Engine
    mission: Mission
    kernel: Kernel
    options: Options
    budget: api.Budget
    search: api.Turns | None = None
    count: int = 0
    """Number of turns so far."""
    attempts: int = 0
    """Number of pauses so far, which is the number of attempts for an engine that works in attempts."""
    work: float = 0.0
    seconds: float = 0.0
    said: api.Outcome | None = None

    @property
    def name(self) -> str:
        return self.engine.name

    def turn(self, most: float, refused: float = math.inf) -> None:
        """Run the engine until its work reaches ``most``, it has an answer, or its attempts after a refusal are used
        up.

        Args:
            refused: work units of the refusal; infinite without a refusal.
        """
        begin = time.perf_counter()
        self.count += 1
        try:
            search = self.search or self.begun()
            while self.work < most and not self.had_chance(refused):
                self.work = search.send(most)
                self.attempts += 1
        except StopIteration as ended:
            self.said = ended.value
            self.work = ended.value.report.work or self.work
        except MemoryError as error:
            self.said = api.NotFound(
                api.Reason.MEMORY, str(error) or api.Reason.MEMORY.value, api.Report(work=self.work)
            )
        finally:
            self.seconds += time.perf_counter() - begin

    def had_chance(self, refused: float) -> bool:
        """Return true if the engine has had enough attempts after a refusal that took ``refused`` work units."""
        if self.engine.repeats:
            return self.work >= FIRST or refused < math.inf
        return self.attempts >= ATTEMPTS and self.work >= TIMES * refused

    def begun(self) -> api.Turns:
        """Start the engine's search and return it, before its first turn."""
        backend = self.engine.load()
        budget = self.budget
        told = replace(
            budget,
            work=math.inf,
            on_progress=lambda progress: budget.on_progress(replace(progress, engine=self.name)),
            on_incumbent=lambda plan: budget.on_incumbent(self.named(plan)),
        )
        self.search = search = backend.turns(self.mission, self.kernel, self.options, told)
        next(search)
        return search

    def named(self, plan: api.Planned) -> api.Planned:
        """Plan whose report names this engine."""
        return replace(plan, report=replace(plan.report, engine=self.name))

    def close(self) -> None:
        """Stop the engine's search."""
        if self.search is not None:
            self.search.close()

    @property
    def failed(self) -> api.NotFound | None:
        """Engine's answer if it found nothing; None otherwise."""
        return self.said if isinstance(self.said, api.NotFound) else None

    @property
    def refusal(self) -> api.Impossible | None:
        """Engine's answer if its roadmaps contain no plan; None otherwise."""
        return self.said if isinstance(self.said, api.Impossible) else None

    @property
    def says(self) -> str:
        """Description of the engine's result."""
        match self.said:
            case api.Planned():
                return "plan found"
            case api.Impossible(statement=statement) | api.NotFound(statement=statement):
                return statement
            case _:
                return f"no plan in {counted(self.attempts, 'attempt')}" if self.count else "not run"

    @property
    def tried(self) -> api.Tried:
        """Summary of the engine's turns, work and result."""
        return api.Tried(self.name, self.count, round(self.work, 3), Seconds(self.seconds), self.says)


def in_turns(runs: list[Run]) -> api.Turns:
    """Search in turns of several engines: the first plan, or the combined answer."""
    granted, most = (yield 0.0), FIRST
    while waiting := _waiting(runs):
        ready = [run for run in waiting if run.work < most]
        if not ready:
            most *= LONGER
            continue
        run, done = ready[0], sum(each.work for each in runs)
        run.turn(run.work + granted - done if len(waiting) == 1 else most, _refused(runs))
        if isinstance(run.said, api.Planned):
            return _with_accounts(run.named(run.said), runs)
        if run.failed is not None and run.failed.reason is api.Reason.TIME:
            for other in waiting:  # each checks the clock at once, and reports its best candidate
                if other.said is None and other.search is not None:
                    other.turn(math.inf)
            break
        granted = yield sum(each.work for each in runs)
    return _with_accounts(_together(runs), runs)


def _refused(runs: list[Run]) -> float:
    """Work units of the engine that was first to refuse by roadmaps; infinite without a refusal."""
    return min((run.work for run in runs if run.refusal is not None), default=math.inf)


def _waiting(runs: list[Run]) -> list[Run]:
    """Engines that have turns left, in their order."""
    refused = _refused(runs)
    return [run for run in runs if run.said is None and not run.had_chance(refused)]


def _together(runs: list[Run]) -> api.Impossible | api.NotFound:
    """Combined answer without a plan: a refusal by roadmaps, unless another engine ran out of time."""
    failed = [(run, run.failed) for run in runs if run.failed is not None]
    reasons = [said.reason for _, said in failed]
    for run in runs:
        if run.refusal is not None and api.Reason.TIME not in reasons:
            others = [
                f"{other.name} found no plan in {counted(other.attempts, 'attempt')}"
                for other in runs
                if other is not run and other.count
            ]
            refused = replace(run.refusal, statement="; ".join([run.refusal.statement, *others]))
            return replace(refused, report=replace(refused.report, engine=run.name))
    nearest, said = min(failed, key=lambda each: math.inf if each[1].best is None else each[1].best.wrong)
    reason = min(reasons, key=WORST.index)
    more = [f"{run.name}: {run.says}" for run in runs if run.count and run.says != reason.value]
    report = replace(said.report, engine=nearest.name)
    return replace(said, reason=reason, statement="; ".join(more) or reason.value, report=report)


def _with_accounts(outcome: api.Outcome, runs: list[Run]) -> api.Outcome:
    """Outcome with the summary of each engine in its report; the seconds of other engines are listed under their
    names."""
    report = outcome.report
    others = [(run.name, Seconds(run.seconds)) for run in runs if run.count and run.name != report.engine]
    report = replace(
        report,
        seconds=(*others, *report.seconds),
        work=sum(run.work for run in runs),
        tried=tuple(run.tried for run in runs),
    )
    return replace(outcome, report=report)
