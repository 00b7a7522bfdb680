"""Relaxation search for an infeasible mission: variants are solved by bisection until the time is over.

    in   Checked, the backend's Impossible, or a NotFound with its best candidate; a budget
    out  Explained

Changes that show the cause come first: the requirements in conflict left out, a longer horizon, and a finer roadmap
if only roadmaps were refused. Then follows every number that these requirements use, in the order of the text. Of one
kind of change, the first ones are tried until one is feasible, then smaller ones by bisection. Each variant is
checked from its text on, planned and verified; a variant that fails is no relaxation.

A search that found no plan has refused nothing. The requirements that its candidate violates then stand for those in
conflict, and none is named as the cause.

Guards are the requirements that keep people and things safe. A relaxation is compared with them: does the motion that
it makes possible violate a guard, or come closer than bodies may?
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from missionc.backends import api
from missionc.backends.options import Options
from missionc.base.signals import stop_requested
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler.ask_cover import CoverSide
from missionc.compiler.certify_plan import to_draw
from missionc.compiler.front_end import Checked, check
from missionc.compiler.plan_with_margin import plan_with_margin
from missionc.compiler.relax import relax_world
from missionc.compiler.relax.conflict_targets import conflict_targets
from missionc.compiler.relax.edits import Edit, changes, edited
from missionc.compiler.relax.nearest_miss import Advice, Remedy, near_miss
from missionc.compiler.relax.relaxation_parameters import RelaxationParameter
from missionc.compiler.results import Blame, Explained, Relaxation, Trial
from missionc.compiler.strategy import COVERS
from missionc.ir import Mission
from missionc.ir.kernel.nodes import All, At, Atom, Kernel, NeighbourNode, Node, Not, UntilNode, WindowNode
from missionc.ir.kernel.walk import bottom_up, children, postorder, rebuilt
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH
from missionc.verification.verify_plan import verify


@dataclass(slots=True)
class Bracket:
    """What is known of one knob: the smallest change that does, and the largest one below it that does not.

    Changes of one kind are taken to do where a smaller one does; none is believed before it has been tried.
    """

    knob: RelaxationParameter
    best: int | None = None
    refused: int = 0
    tries: int = 0
    proven: bool = True
    """The largest one that does not was refused, rather than left undecided; no change at all was refused."""

    def next(self) -> int | None:
        """How many notches to try; None where nothing is left to learn."""
        if self.best is not None:
            return (self.refused + self.best) // 2 if self.best - self.refused > 1 else None
        if self.refused >= self.knob.most:
            return None
        return min(self.knob.most, max(self.knob.first, 2 * self.refused))

    def learn(self, notches: int, *, does: bool, proven: bool) -> None:
        self.tries += 1
        if does:
            self.best = notches
        else:
            self.refused, self.proven = notches, proven

    @property
    def smallest(self) -> bool:
        """Whether the next smaller change was refused."""
        return self.best is not None and self.best - self.refused == 1 and self.proven


ROOM = frozenset(("separation", "obstacle"))
"""Checks of the room between bodies, and between bodies and obstacles."""


def gives_up_safety(mission: Mission, kernel: Kernel, trace: Trace) -> bool:
    """Whether a motion of the same agents breaks a guard of the mission as written.

    In one that lasts longer the guards do too that last to the mission's end.
    """
    agents, states = trace.position.shape[:2]
    if agents != len(mission.agents) or states <= mission.steps:
        return False
    guarding = [goal for goal in kernel.requirements if guards(goal.formula)]
    if states == mission.steps + 1:
        named = {goal.name for goal in guarding}
        failed = verify(mission, kernel, trace).failures
        return any(check.name in ROOM or (check.name == "requirement" and check.subject in named) for check in failed)
    lasting = [_to_the_end(goal.formula, mission.steps) for goal in guarding]
    truths = Evaluation(TRUTH, mission, trace).values(lasting)
    return not all(truths[formula][0, 0] for formula in lasting)


def _to_the_end(formula: Node, last: int) -> Node:
    """The formula with what lasts to the last step lasting to whatever end there is."""

    def lasting(node: Node, below: tuple[Node, ...]) -> Node:
        same = rebuilt(node, below)
        return replace(same, high=None) if isinstance(same, WindowNode) and same.every and same.high == last else same

    return bottom_up((formula,), lasting)[formula]


def guards(formula: Node) -> bool:
    """Whether a requirement asks that something always is, or is not: no event that it waits for makes it true.

    ``always[0, 20 s] not fire`` does, and so does who keeps out of a place until another thing happens;
    ``always eventually[0, 5 s] base`` waits for events.
    """
    match formula:
        case All(parts):
            return any(map(guards, parts))
        case At(_, body):
            return guards(body)
        case NeighbourNode(_, body):
            return formula.every and guards(body)
        case WindowNode(body) if formula.every:
            return not any(_waits(node) for node in postorder((body,)))
        case UntilNode(hold, _) if not formula.every:
            return any(_denies(node) for node in _together(hold))
        case _:
            return _denies(formula)


def _waits(node: Node) -> bool:
    return isinstance(node, WindowNode | UntilNode) and not node.every


def _denies(node: Node) -> bool:
    """That an agent is not in a region."""
    return isinstance(node, Not) and isinstance(node.body, Atom) and bool(node.body.predicate.regions)


def _together(node: Node) -> list[Node]:
    """The formulas that all have to hold for this one to hold."""
    return [each for part in children(node) for each in _together(part)] if isinstance(node, All) else [node]


FIRST, FINER, SHARE, SEARCHED = 0.05, 0.1, 0.25, 0.1
"""Shares of all the work: for the first try of a knob at most; for a finer roadmap, which is the hardest; for
any other try. A knob's later tries get twice as much each. Where none is ever refused and each would take what it gets,
all get the last."""

UNITS, CHECKED, LONGEST = 0.5, 0.02, 4.0
"""Units of ``work`` for each second of the limit: it is work that ends a try and the search, so that one seed gives the
same advice, and the time that is left over is for machines that do less in a second. What a variant takes at least; and
how many times its share of the time a try takes at most."""

RELAXED_COVERS, PROOFS = 4, 0.1
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
    backend: api.Backend
    options: Options
    budget: api.Budget
    first: float
    share: float
    begin: float = field(default_factory=time.monotonic)
    count: int = 0
    units: float = math.inf
    """Units of work that all tries may take, and ``spent``, those that they took."""
    spent: float = 0.0
    found: dict[int, Tried] = field(default_factory=dict)
    """The motion of each knob's smallest change that does."""
    tried: list[Bracket] = field(default_factory=list)

    @property
    def late(self) -> bool:
        return stop_requested() or time.monotonic() >= self.budget.deadline

    @property
    def over(self) -> bool:
        return self.late or self.spent >= self.units

    def step(self, trying: Bracket, first: float) -> Trial | None:
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
        self.budget.on_progress(api.Progress("explain", self.count, edit.says))
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
            on_progress=api.ignore,
            on_snapshot=api.discard_snapshot,
            resume=None,
            lower_bound=api.no_bound,
        )
        came = plan_with_margin(self.backend, mission, kernel, self.options, budget)
        self.spent += max(CHECKED, came.report.work)
        if isinstance(came, api.Impossible):
            return Tried("impossible")
        if isinstance(came, api.Planned) and verify(mission, kernel, came.trace).passed:
            return Tried("planned", Remedy(variant, came.trace))
        return Tried("undecided")

    def trial(self, knobs: Iterable[RelaxationParameter], part: float = SHARE) -> list[Trial]:
        """The first change of each knob, tried in that part of all the time; their others come later."""
        trials: list[Trial] = []
        for knob in knobs:
            trying = Bracket(knob)
            self.tried.append(trying)
            came = None if self.over else self.step(trying, part)
            trials += [came] if came is not None else []
        return trials

    def refine(self, knobs: Iterable[RelaxationParameter]) -> None:
        """One change of each knob after the other, until there is nothing left to try or no time."""
        self.tried += map(Bracket, knobs)
        going = True
        while going:
            going = False
            for trying in self.tried:
                if self.over:
                    return
                going = self.step(trying, self.first) is not None or going

    def proven_not(self, trying: Bracket) -> str:
        """The largest change of a knob that a cover is found to refuse, below one that does; empty where none is.

        Changes are halved as far as a few covers show.
        """
        proven, low, high = "", 0, trying.refused + 1
        for _ in range(RELAXED_COVERS):
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
            return CoverSide(mission, ahead, kernel, options, self.budget).refusal(COVERS.first) is not None
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
    checked: Checked,
    refusal: api.Impossible | api.NotFound,
    backend: api.Backend,
    options: Options,
    budget: api.Budget,
    limit: Seconds,
) -> Explained:
    """Who is to blame and what helps, as far as can be told within ``limit``, seconds, and the budget's deadline."""
    mission, kernel = checked.valid_mission, checked.valid_kernel
    now = time.monotonic()
    drawn = to_draw(limit) if isinstance(refusal, api.NotFound) else 0.0
    short = replace(budget, deadline=min(budget.deadline - drawn, now + limit))
    quick = replace(options, certify=False, captures=frozenset(), margin=0.0, brief=True)
    best = refusal.best if isinstance(refusal, api.NotFound) else None
    first, share = (SEARCHED, SEARCHED) if best else (FIRST, SHARE)
    proofs = isinstance(refusal, api.Impossible) and refusal.scope is api.Scope.MISSION
    until = short.deadline
    if proofs:
        short = replace(short, deadline=now + (1 - PROOFS) * max(0.0, until - now))
    run = Explaining(checked, mission, kernel, backend, quick, short, first, share, now)
    run.units = UNITS * max(0.0, short.deadline - now)
    conflict = refusal.conflict if isinstance(refusal, api.Impossible) else _violated(best)
    without = run.trial(relax_world.without(checked, mission, conflict))
    if len(conflict) > 1 and not any(trial.outcome == "planned" for trial in without):
        without += run.trial(relax_world.without_all(checked, mission, conflict))
    longer = run.trial(relax_world.horizon(checked, mission))
    scope = refusal.scope if isinstance(refusal, api.Impossible) else None
    nodes = dict(refusal.report.sizes).get("nodes", 0)
    finer = run.trial(relax_world.roadmap(checked, nodes), FINER) if scope is not api.Scope.MISSION else []
    run.refine(_knobs(checked, mission, kernel, conflict))
    cut_short = run.over
    run.budget = replace(run.budget, deadline=until)
    relaxations = run.relaxations(proofs=proofs)
    blame = _blame(without, longer, finer) if isinstance(refusal, api.Impossible) else Blame.UNKNOWN
    trials = (*without, *longer, *finer)
    missed = near_miss(checked, backend.name, budget.seed, relaxations, best, scope, Advice(conflict, trials))
    return Explained(blame, trials, tuple(relaxation for relaxation, _ in relaxations), missed, cut_short)


def _violated(best: api.Attempt | None) -> tuple[str, ...]:
    return tuple(each.name for each in best.violated) if best else ()


def _knobs(checked: Checked, mission: Mission, kernel: Kernel, conflict: tuple[str, ...]) -> list[RelaxationParameter]:
    """Every number that the requirements in conflict touch, and what every plan has to keep."""
    asks = conflict_targets(goal.formula for goal in kernel.requirements if goal.name in conflict)
    return [
        *relax_world.windows(checked, mission, asks),
        *relax_world.lengths(checked, mission, asks),
        *relax_world.counts(checked, asks),
        *relax_world.comparisons(checked, asks),
        *relax_world.headings(checked, asks),
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
