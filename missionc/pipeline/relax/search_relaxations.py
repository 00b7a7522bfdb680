"""Relaxation search for an infeasible mission: variants of it are solved until its time is over.

    in   Checked, the backend's Impossible, or a NotFound with its best candidate; a budget
    out  Explained

First what tells who is to blame: the requirements in conflict left out, a longer
horizon, a finer roadmap where only roadmaps were refused. Then every number that these requirements touch, one
try after the other, in the order of the text. Each variant is checked from its
text on, planned and verified; what is not is no relaxation. A search that found nothing has refused
nothing: its candidate's requirements stand for those in conflict, and nobody is to blame.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from missionc.backends.api import (
    Attempt,
    Backend,
    Budget,
    Impossible,
    NotFound,
    Planned,
    Progress,
    Scope,
    forget,
    ignore,
    open_ended,
)
from missionc.backends.options import Options
from missionc.base.signals import asked
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.lower.unroll_past import looking_ahead
from missionc.pipeline.ask_cover import LITTLE, CoverSide
from missionc.pipeline.certify_plan import to_draw
from missionc.pipeline.checked import Checked
from missionc.pipeline.front_end import check
from missionc.pipeline.plan_with_margin import plan_with_margin
from missionc.pipeline.relax import relax_formulas, relax_time, relax_world
from missionc.pipeline.relax.bisection import Trying
from missionc.pipeline.relax.conflict_targets import conflict_targets
from missionc.pipeline.relax.edits import Edit, changes, edited
from missionc.pipeline.relax.guards import gives_up_safety
from missionc.pipeline.relax.knobs import Knob
from missionc.pipeline.relax.nearest_miss import Advice, Remedy, near_miss
from missionc.pipeline.results import Blame, Explained, Relaxation, Trial
from missionc.verify.verify_plan import verify

FIRST, FINER, SHARE, SEARCHED = 0.05, 0.1, 0.25, 0.1
"""Shares of all the work: for the first try of a knob at most; for a finer roadmap, which is the hardest; for
any other try. A knob's later tries get twice as much each. Where none is ever refused and each would take what it gets,
all get the last."""

UNITS, CHECKED, LONGEST = 0.5, 0.02, 4.0
"""Units of ``work`` for each second of the limit: it is work that ends a try and the search, so that one seed gives the
same advice, and the time that is left over is for machines that do less in a second. What a variant takes at least; and
how many times its share of the time a try takes at most."""

COVERS, PROOFS = 4, 0.1
"""Covers asked about smaller changes of a knob at most, and the share of all the time that is left for them."""


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """How a variant came out: ``planned`` with a verified motion, ``impossible``, ``undecided``, or ``wrong``."""

    outcome: str
    remedy: Remedy | None = None


@dataclass(slots=True, eq=False)
class Explaining:
    """One explanation as it goes on; ``tried`` are the knobs in the order in which they are tried."""

    checked: Checked
    mission: Mission
    kernel: Kernel
    backend: Backend
    options: Options
    budget: Budget
    first: float
    share: float
    begin: float = field(default_factory=time.monotonic)
    count: int = 0
    units: float = math.inf
    """Units of work that all tries may take, and ``spent``, those that they took."""
    spent: float = 0.0
    found: dict[int, Tried] = field(default_factory=dict)
    """The motion of each knob's smallest change that does."""
    tried: list[Trying] = field(default_factory=list)

    @property
    def late(self) -> bool:
        return asked() or time.monotonic() >= self.budget.deadline

    @property
    def over(self) -> bool:
        return self.late or self.spent >= self.units

    def step(self, trying: Trying, first: float) -> Trial | None:
        """Tries the knob's next change that is a mission at all; None where there is none."""
        while (notches := trying.next()) is not None:
            edit = trying.knob.edit(notches)
            part = min(self.share, first * 2**trying.tries)
            came = Tried("wrong") if edit is None else self.solve(edit, part)
            does = came.outcome == "planned"
            trying.learn(notches, does=does, proven=came.outcome == "impossible")
            if does:
                self.found[id(trying)] = came
            if edit is not None and came.outcome != "wrong":
                return Trial(edit.says, came.outcome)
        return None

    def solve(self, edit: Edit, part: float) -> Tried:
        """The variant checked from its text on, planned in that part of all the time, and verified."""
        self.count += 1
        self.budget.listen(Progress("explain", self.count, edit.says))
        variant = self.variant(edit)
        if variant is None:
            return Tried("wrong")
        try:
            return self.planned(variant, part)
        except MemoryError:
            return Tried("undecided")

    def variant(self, edit: Edit) -> Checked | None:
        """The mission with an edit, checked from its text on; None where it is none."""
        source, overrides = edited(self.checked, edit)
        checked = check(
            source,
            overrides=overrides,
            backend=self.backend.name,
            limits=self.budget.limits,
            vehicle=self.checked.vehicle,
            poses=self.checked.poses,
        )
        return checked if checked.ok and checked.mission is not None and checked.kernel is not None else None

    def planned(self, variant: Checked, part: float) -> Tried:
        mission, kernel = variant.valid_mission, variant.valid_kernel
        now = time.monotonic()
        budget = replace(
            self.budget,
            deadline=min(self.budget.deadline, now + LONGEST * part * (self.budget.deadline - self.begin)),
            work=part * self.units,
            listen=ignore,
            keep=forget,
            resume=None,
            enough=open_ended,
        )
        came = plan_with_margin(self.backend, mission, kernel, self.options, budget)
        self.spent += max(CHECKED, came.report.work)
        if isinstance(came, Impossible):
            return Tried("impossible")
        if isinstance(came, Planned) and verify(mission, kernel, came.trace).passed:
            return Tried("planned", Remedy(variant, came.trace))
        return Tried("undecided")

    def trial(self, knobs: Iterable[Knob], part: float = SHARE) -> list[Trial]:
        """The first change of each knob, tried in that part of all the time; their others come later."""
        trials: list[Trial] = []
        for knob in knobs:
            trying = Trying(knob)
            self.tried.append(trying)
            came = None if self.over else self.step(trying, part)
            trials += [came] if came is not None else []
        return trials

    def refine(self, knobs: Iterable[Knob]) -> None:
        """One change of each knob after the other, until there is nothing left to try or no time."""
        self.tried += map(Trying, knobs)
        going = True
        while going:
            going = False
            for trying in self.tried:
                if self.over:
                    return
                going = self.step(trying, self.first) is not None or going

    def proven_not(self, trying: Trying) -> str:
        """The largest change of a knob that a cover is found to refuse, below one that does; empty where none is.

        Changes are halved as far as a few covers show.
        """
        proven, low, high = "", 0, trying.refused + 1
        for _ in range(COVERS):
            if trying.best is None or high - low <= 1 or self.late:
                break
            notches = trying.refused if high > trying.refused else (low + high) // 2
            edit = trying.knob.edit(notches)
            if edit is not None and self.refused_by_cover(edit):
                proven, low = edit.to or edit.says, notches
            else:
                high = notches
        return proven

    def refused_by_cover(self, edit: Edit) -> bool:
        """Whether no motion at all satisfies the variant, as covers show with little work."""
        variant = self.variant(edit)
        if variant is None:
            return False
        mission, kernel = variant.valid_mission, variant.valid_kernel
        ahead = looking_ahead(mission, kernel, self.budget.limits.formula_nodes)
        if not isinstance(ahead, Kernel):
            return False
        options = replace(self.options, certify=False)
        try:
            return CoverSide(mission, ahead, kernel, options, self.budget).refusal(LITTLE) is not None
        except MemoryError:
            return False

    def relaxations(self, *, proofs: bool) -> list[tuple[Relaxation, Remedy]]:
        """What does, the smallest change first; what is as large in the order in which it was tried.

        Last comes what gives up some of what keeps others safe.

        Args:
            proofs: whether covers are asked about smaller changes.
        """
        relaxations = []
        for trying in self.tried:
            edit = None if trying.best is None else trying.knob.edit(trying.best)
            came = self.found.get(id(trying))
            if edit is None or came is None or came.remedy is None or trying.best is None:
                continue
            size = trying.best * trying.knob.size
            lines = changes(edit, self.checked.overrides)
            proven = self.proven_not(trying) if proofs else ""
            guards = gives_up_safety(self.mission, self.kernel, came.remedy.trace)
            relaxations.append((Relaxation(edit.says, lines, size, trying.smallest, proven, guards), came.remedy))
        return sorted(relaxations, key=lambda each: (each[0].guards, each[0].size))


def explain(
    checked: Checked, refusal: Impossible | NotFound, backend: Backend, options: Options, budget: Budget, limit: Seconds
) -> Explained:
    """Who is to blame and what helps, as far as can be told within ``limit``, seconds, and the budget's deadline."""
    mission, kernel = checked.valid_mission, checked.valid_kernel
    now = time.monotonic()
    drawn = to_draw(limit) if isinstance(refusal, NotFound) else 0.0
    short = replace(budget, deadline=min(budget.deadline - drawn, now + limit))
    quick = replace(options, certify=False, captures=frozenset(), margin=0.0, brief=True)
    best = refusal.best if isinstance(refusal, NotFound) else None
    first, share = (SEARCHED, SEARCHED) if best else (FIRST, SHARE)
    proofs = isinstance(refusal, Impossible) and refusal.scope is Scope.MISSION
    until = short.deadline
    if proofs:
        short = replace(short, deadline=now + (1 - PROOFS) * max(0.0, until - now))
    run = Explaining(checked, mission, kernel, backend, quick, short, first, share, now)
    run.units = UNITS * max(0.0, short.deadline - now)
    conflict = refusal.conflict if isinstance(refusal, Impossible) else _violated(best)
    without = run.trial(relax_formulas.without(checked, mission, conflict))
    if len(conflict) > 1 and not any(trial.outcome == "planned" for trial in without):
        without += run.trial(relax_formulas.without_all(checked, mission, conflict))
    longer = run.trial(relax_time.horizon(checked, mission))
    scope = refusal.scope if isinstance(refusal, Impossible) else None
    nodes = dict(refusal.report.sizes).get("nodes", 0)
    finer = run.trial(relax_world.roadmap(checked, nodes), FINER) if scope is not Scope.MISSION else []
    run.refine(_knobs(checked, mission, kernel, conflict))
    cut_short = run.over
    run.budget = replace(run.budget, deadline=until)
    relaxations = run.relaxations(proofs=proofs)
    blame = _blame(without, longer, finer) if isinstance(refusal, Impossible) else Blame.UNKNOWN
    trials = (*without, *longer, *finer)
    missed = near_miss(checked, backend.name, budget.seed, relaxations, best, scope, Advice(conflict, trials))
    return Explained(blame, trials, tuple(relaxation for relaxation, _ in relaxations), missed, cut_short)


def _violated(best: Attempt | None) -> tuple[str, ...]:
    return tuple(each.name for each in best.violated) if best else ()


def _knobs(checked: Checked, mission: Mission, kernel: Kernel, conflict: tuple[str, ...]) -> list[Knob]:
    """Every number that the requirements in conflict touch, and what every plan has to keep."""
    asks = conflict_targets(goal.formula for goal in kernel.requirements if goal.name in conflict)
    return [
        *relax_time.windows(checked, mission, asks),
        *relax_formulas.lengths(checked, mission, asks),
        *relax_formulas.counts(checked, asks),
        *relax_formulas.comparisons(checked, asks),
        *relax_formulas.headings(checked, asks),
        *relax_world.graphs(checked, asks),
        *relax_world.formations(checked, asks),
        *relax_world.regions(checked, mission, asks),
        *relax_world.margins(checked),
        *relax_world.teams(checked),
    ]


def _blame(without: list[Trial], longer: list[Trial], finer: list[Trial]) -> Blame:
    """The least that does: a finer roadmap, more time, fewer requirements."""
    for blame, trials in ((Blame.ROADMAP, finer), (Blame.HORIZON, longer), (Blame.REQUIREMENTS, without)):
        if any(trial.outcome == "planned" for trial in trials):
            return blame
    return Blame.UNKNOWN
