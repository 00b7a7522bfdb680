"""Relaxation search for an infeasible mission: variants are solved by bisection until the time is over.

    in   Checked, the backend's Impossible, or a NotFound with its best candidate; a budget
    out  Explained

Changes that show the cause come first: the requirements in conflict left out, a longer horizon, and a finer roadmap if
the mission is infeasible only on roadmaps. Then follows every number that these requirements use, in the order of the
text. For one kind of change, increasing changes are tried until one is feasible, then smaller ones by bisection. Each
variant is checked from its text on, planned and verified; a failing variant is not a relaxation.

A search without a plan proves no conflict. The requirements that its candidate violates then replace the requirements
in conflict, and no cause is named.

Guards are the safety requirements. Each relaxation is checked against them: whether its motion violates a guard, or the
separation of bodies.

Closest infeasible candidate: of the available trajectories, the one with the smallest violation.

in   original Mission, its kernel, plans of relaxed missions, a search's best candidate
out  NearMiss, if one of them violates only one requirement, or there is a candidate
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath

from missionc.backends import api
from missionc.backends.api import Attempt, Scope
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.signals import stop_requested
from missionc.base.trace import Plan, Trace
from missionc.base.units import Seconds
from missionc.compiler.ask_cover import CoverSide
from missionc.compiler.certify_plan import to_draw
from missionc.compiler.front_end import Checked, check
from missionc.compiler.plan_with_margin import plan_with_margin
from missionc.compiler.provenance import texts
from missionc.compiler.relax import relax_world
from missionc.compiler.relax.edits import Edit, RelaxationParameter, changes, conflict_targets, edited
from missionc.compiler.results import Blame, Explained, NearMiss, Relaxation, Trial
from missionc.compiler.strategy import COVERS
from missionc.ir import Mission
from missionc.ir.kernel.nodes import All, At, Atom, Kernel, NeighbourNode, Node, Not, UntilNode, WindowNode
from missionc.ir.kernel.walk import bottom_up, children, postorder, rebuilt
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.output.documents.near_miss_json import near_miss_json
from missionc.output.folder.manifest import sha256
from missionc.output.plot.plot import plot
from missionc.output.report.report_html import Plotted, report
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH
from missionc.verification.verify_plan import verify

MOST_PLAYED = 12
"""Maximum number of suggested changes whose plans the page can replay; further ones are shown as text only."""


class Remedy(Record, eq=False):
    """A relaxed mission, with its verified plan."""

    checked: Checked
    trace: Trace


class Advice(Record, eq=False):
    """Explanation of the infeasibility for the page: the conflicting requirements, and the variants that were tried."""

    conflict: tuple[str, ...] = ()
    trials: tuple[Trial, ...] = ()


def near_miss(
    checked: Checked,
    backend: str,
    seed: int,
    relaxations: Sequence[tuple[Relaxation, Remedy]],
    best: Attempt | None = None,
    scope: Scope | None = None,
    advice: Advice | None = None,
) -> NearMiss | None:
    """Closest infeasible candidate with its files, or None if there is none.

    The files are ``near_miss.json``, ``near_miss.html``, and ``near_miss.svg`` if maps can be drawn.

    Args:
        backend, seed: backend and seed of the trajectories.
        relaxations: suggested changes, each with the plan of the relaxed mission.
        best: candidate of a search without a plan.
        scope: scope of the proof of infeasibility, if any.
        advice: explanation for the page.
    """
    mission, kernel = checked.valid_mission, checked.valid_kernel
    motions = [(each.says, remedy.trace) for each, remedy in relaxations] + ([("", best.trace)] if best else [])
    misses = [(_miss(mission, kernel, trace), says) for says, trace in motions]
    near = [(miss, says) for miss, says in misses if miss is not None]
    if near:
        miss, says = max(near, key=lambda each: _by(each[0]))
    elif best is not None:
        miss, says = best, ""
    else:
        return None
    document = near_miss_json(mission, miss, says, scope).encode()
    plan = Plan(mission.name, backend, seed, miss.trace, miss.requirements)
    certificate = verify(mission, kernel, miss.trace)
    violation = miss.violation(mission.step)
    shown = Plotted(mission, kernel, plan, certificate, {}, texts(checked), violation, digest=sha256(document))
    told = _told(advice or Advice(), violation, [relaxation for relaxation, _ in relaxations])
    page = report(shown, advice=(told, [_played(each, backend, seed) for _, each in relaxations[:MOST_PLAYED]]))
    files = [("near_miss.json", document), ("near_miss.html", page)]
    picture = plot(mission, miss.trace, backend, "svg", miss)
    if not isinstance(picture, Diagnostic):
        files.append(("near_miss.svg", picture))
    return NearMiss(miss, says, tuple(files))


def _miss(mission: Mission, kernel: Kernel, trace: Trace) -> Attempt | None:
    """Evaluation of a trajectory that violates exactly one requirement of this mission.

    None for any other trajectory.
    """
    if trace.position.shape[:2] != (len(mission.agents), mission.steps + 1):
        return None
    certificate = verify(mission, kernel, trace)
    if [failure.name for failure in certificate.failures] != ["requirement"]:
        return None
    miss = Attempt(certificate.judgements, (), trace)
    return miss if len(miss.violated) == 1 else None


def _by(miss: Attempt) -> float:
    robustness = miss.violated[0].robustness
    return robustness if math.isfinite(robustness) else -math.inf


def _played(remedy: Remedy, backend: str, seed: int) -> Plotted:
    """Plan of a relaxed mission, without polynomials, as the page needs it."""
    mission, kernel = remedy.checked.valid_mission, remedy.checked.valid_kernel
    certificate = verify(mission, kernel, remedy.trace)
    plan = Plan(mission.name, backend, seed, remedy.trace, certificate.judgements)
    return Plotted(mission, kernel, plan, certificate, {}, texts(remedy.checked))


def _told(advice: Advice, violation: str, relaxations: Sequence[Relaxation]) -> dict[str, object]:
    """Explanation in the page's format; the plan of a change is numbered after the candidate."""
    return {
        "conflict": list(advice.conflict),
        "trials": [{"change": trial.says, "outcome": trial.outcome} for trial in advice.trials],
        "miss": violation,
        "changes": [
            {
                "change": each.says,
                "edits": [
                    {
                        "file": PurePath(edit.file).name,
                        "line": edit.line,
                        "before": edit.before,
                        "after": edit.after,
                    }
                    for edit in each.changes
                ],
                "smallest": each.smallest,
                "proven": each.proven,
                "guards": each.guards,
                "plan": rank if rank <= MOST_PLAYED + 1 else None,
            }
            for rank, each in enumerate(relaxations, 2)
        ],
    }


@dataclass(slots=True)
class Bracket:
    """Results so far for one parameter: the smallest sufficient change, and the largest insufficient change below it.

    A larger change of one kind is assumed to suffice if a smaller one does; each reported change has been tried.
    """

    knob: RelaxationParameter
    best: int | None = None
    refused: int = 0
    tries: int = 0
    proven: bool = True
    """True if the largest insufficient change was proved infeasible instead of undecided; true for no change at all."""

    def next(self) -> int | None:
        """Size of the next change to try, in multiples of the parameter's step size; None if finished."""
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
        """True if the next smaller change was proved insufficient."""
        return self.best is not None and self.best - self.refused == 1 and self.proven


ROOM = frozenset(("separation", "obstacle"))
"""Names of the checks of separation and clearance."""


def gives_up_safety(mission: Mission, kernel: Kernel, trace: Trace) -> bool:
    """Return whether a trajectory of the same agents violates a guard (safety requirement) of the original mission.

    In a longer trajectory, guards to the mission's end also last longer.
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
    """The formula with its windows to the last step extended to the end of any trajectory."""

    def lasting(node: Node, below: tuple[Node, ...]) -> Node:
        same = rebuilt(node, below)
        return replace(same, high=None) if isinstance(same, WindowNode) and same.every and same.high == last else same

    return bottom_up((formula,), lasting)[formula]


def guards(formula: Node) -> bool:
    """Return whether a requirement is a guard: it is permanent, so that it does not wait for an event.

    ``always[0, 20 s] not fire`` is permanent, and so is avoiding a region until an event; ``always eventually[0, 5 s]
    base`` waits for events.
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
    """Return whether a formula states that an agent is not in a region."""
    return isinstance(node, Not) and isinstance(node.body, Atom) and bool(node.body.predicate.regions)


def _together(node: Node) -> list[Node]:
    """Conjuncts of a formula, which must all hold for it to hold."""
    return [each for part in children(node) for each in _together(part)] if isinstance(node, All) else [node]


FIRST, FINER, SHARE, SEARCHED = 0.05, 0.1, 0.25, 0.1
"""Limits as fractions of the total work.

``FIRST`` limits the first attempt of a parameter, ``FINER`` a finer roadmap, which is the hardest, and ``SHARE`` any
other attempt. Later attempts get twice as much each. If no attempt is proved infeasible and each uses its work, all of
them together get ``SEARCHED``.
"""

UNITS, CHECKED, LONGEST = 0.5, 0.02, 4.0
"""Units of ``work`` per second of the time limit; minimum work of a variant; maximum work of one, in attempts.

Work ends each attempt and the search, so that one seed gives one explanation on every machine.
"""

RELAXED_COVERS, PROOFS = 4, 0.1
"""Maximum number of covers for smaller changes of a parameter, and the fraction of the remaining time for them."""


class Tried(Record, eq=False):
    """Result for a variant of the mission.

    ``planned`` has a verified trajectory; the others are ``impossible``, ``undecided``, and ``wrong`` for an invalid
    variant.
    """

    outcome: str
    remedy: Remedy | None = None


@dataclass(slots=True, eq=False)
class Explaining:
    """State of one relaxation search; ``tried`` lists the parameters in the order of their attempts."""

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
    """Work limit of all attempts together, in units; ``spent`` is the work so far."""
    spent: float = 0.0
    found: dict[int, Tried] = field(default_factory=dict)
    """Result of each parameter's smallest sufficient change."""
    tried: list[Bracket] = field(default_factory=list)

    @property
    def late(self) -> bool:
        return stop_requested() or time.monotonic() >= self.budget.deadline

    @property
    def over(self) -> bool:
        return self.late or self.spent >= self.units

    def step(self, trying: Bracket, first: float) -> Trial | None:
        """Try the parameter's next valid change and return its result; None if there is no further change."""
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
        """Result of a variant of the mission, which is checked from its text, planned and verified.

        Args:
            edit: change of the mission.
            part: fraction of the time for planning.
        """
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
        """The checked mission after an edit; None if it is invalid."""
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
        """Results of the first change of each parameter, within a fraction ``part`` of the time.

        ``refine`` tries others later.
        """
        trials: list[Trial] = []
        for knob in knobs:
            trying = Bracket(knob)
            self.tried.append(trying)
            came = None if self.over else self.step(trying, part)
            trials += [came] if came is not None else []
        return trials

    def refine(self, knobs: Iterable[RelaxationParameter]) -> None:
        """Try one change of each parameter in turn, until all are finished or the time is over."""
        self.tried += map(Bracket, knobs)
        going = True
        while going:
            going = False
            for trying in self.tried:
                if self.over:
                    return
                going = self.step(trying, self.first) is not None or going

    def proven_not(self, trying: Bracket) -> str:
        """Largest change of a parameter that a cover proves insufficient, as text; empty if there is none.

        Bisection uses a few covers.
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
        """Return whether covers with little work prove that no motion satisfies the variant."""
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
        """Sufficient changes, the smallest first, and equal ones in the order of attempts.

        Changes that loosen a safety requirement come last.

        Args:
            proofs: True to test smaller changes with covers.
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
    """Cause of infeasibility and sufficient changes, found within ``limit`` seconds and the budget's deadline."""
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
    """Relaxation parameters for every number in the conflicting requirements and in the conditions of all plans."""
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
    """Cause of infeasibility, the smallest sufficient change first: a finer roadmap, more time, or fewer
    requirements.
    """
    for blame, trials in ((Blame.ROADMAP, finer), (Blame.HORIZON, longer), (Blame.REQUIREMENTS, without)):
        if any(trial.outcome == "planned" for trial in trials):
            return blame
    return Blame.UNKNOWN
