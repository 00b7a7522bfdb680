"""Strategy of a compilation: attempts, their order, their work, and the actions after each outcome.

in   a checked mission, PlanRequest
out  attempts of each stage, carried out by the stages; and the complete strategy as text, for ``--emit strategy``

    search           tries of increasing speed and decreasing margins, by the engines in turns; after a try without a
                     plan, covers: over-approximations of all motions, which may prove that there is none
    verify           a plan that fails ends its engine, and the others search again
    options          plans for the other options, if the engine chose by an estimate
    time scaling     a plan that no vehicle can fly: the search again, at fractions of the speed
    continuous time  a plan that fails between its steps: repairs of it, then other plans
    margins          a plan with a narrow margin: polished towards wider ones, and verified again
    alternatives     further plans that differ
    explain          no plan: changes of the mission that have one

Work is counted in units (``backends.work``), so that the same mission, seed and options take the same path on any
machine. Shares of the remaining time only end stages that would otherwise reach the deadline.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from enum import Enum

from missionc.backends.choose_backend import needs
from missionc.backends.clot.settings import clot_settings
from missionc.backends.clot.spec import CLOT
from missionc.backends.features import Feature
from missionc.backends.load import plans_on_roadmaps
from missionc.backends.portfolio.backend import FIRST, LONGER
from missionc.backends.registry import BACKENDS, is_published
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.model import has_errors
from missionc.base.late_dataclass import Record
from missionc.base.units import Metres
from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import PlanRequest
from missionc.frontend.checks.check_world import check_world
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.tighten import tracking_margin, with_flyable_speeds, with_vehicle_room


class SearchStage(Record):
    """Settings of the search stage: attempts with a robustness margin for tracking error, and finally without.

    Args:
        margins: fractions of the margin that are tried in turn: half of it is better than none.
        bisections: further attempts between two margins, if the user has set one: the larger failed, the smaller did
            not.
        speeds: fractions of the speed that vehicles fly under way, if agents are not in time at the speeds that can be
            flown from rest to rest.
        work: units of each attempt but the last, which has all that is left.
        time: fraction of the remaining time for each of these attempts.
        scarce: seconds; if less is left, an attempt has the fraction ``scarce_time``.
        urgent_time: fraction for each attempt if an agent in flight waits for the plan.
        delays: fractions of the time reserve for delays: an agent that is late seldom needs all of it.
        explanation: fraction of the time that is reserved at most for explaining a result, in a search without an end
            of its own.
    """

    margins: tuple[float, ...] = (1.0, 0.5, 0.0)
    bisections: int = 3
    speeds: tuple[float, ...] = (0.4, 0.55, 0.7, 0.85, 1.0)
    work: float = 16.0
    time: float = 0.25
    scarce: float = 10.0
    scarce_time: float = 0.75
    urgent_time: float = 0.4
    delays: tuple[float, ...] = (1.0, 0.5, 0.25, 0.0)
    explanation: float = 0.25


class CoverStage(Record):
    """Settings of the covers, which may prove that no motion satisfies the mission.

    Args:
        first: units of work after an attempt without a plan.
        failed: units of work after a search without a plan.
        during: for the last attempt, work units of the search, and of the covers then.
        time: fraction of the remaining time.
    """

    first: float = 1.1
    failed: float = 6.0
    during: tuple[tuple[float, float], ...] = ((2.0, 1.1), (20.0, 6.0))
    time: float = 0.5


class BoundStage(Record):
    """Settings of the covers that give a lower bound on the duration: work units, and fraction of the remaining
    time.
    """

    work: float = 3.0
    time: float = 0.25


class TimeScalingStage(Record):
    """Settings of the time scaling stage: slower plans, if the first one cannot be flown.

    Args:
        fractions: fractions of the vehicles' top speeds, tried in turn.
        least: seconds for all of them together, or ``times`` the seconds of the first plan if that is more.
    """

    fractions: tuple[float, ...] = (0.85, 0.7, 0.55, 0.4, 0.25)
    least: float = 10.0
    times: float = 3.0


class StrengthenedSet(Enum):
    """Requirements that an attempt strengthens so that they hold in continuous time."""

    NONE = "none"
    FAILING = "requirements that failed between the samples of a plan"
    ALL = "all"


class Attempt(Record):
    """One search for a plan that satisfies the requirements in continuous time.

    Args:
        lasting: requirements whose parts must last from step to step (``hold_throughout``).
        margin: margin of the failed ones, as a fraction of the fastest agent's distance per step.
        seed: added to the run's seed.
        others: True to use engines other than that of the first plan.
        repaired: True if the search begins at the first plan.
    """

    lasting: StrengthenedSet
    margin: float
    seed: int
    others: bool = False
    repaired: bool = False

    def __str__(self) -> str:
        by = "repair of the first plan" if self.repaired else "other backends" if self.others else "same backend"
        lasting = (
            "" if self.lasting is StrengthenedSet.NONE else f", {self.lasting.name.lower()} requirements strengthened"
        )
        margin = f", robustness margin of 1/{round(1 / self.margin)} of the distance per step" if self.margin else ""
        return f"{by}{lasting}{margin}{f', seed + {self.seed}' if self.seed else ''}"


_NONE, _FAILING, _ALL = StrengthenedSet


class ContinuousTimeStage(Record):
    """Further plans, if requirements of the first one fail between its steps.

    Args:
        repairs: polishes of the first plan.
        on_roadmaps: after a plan on a roadmap, whose backend has already strengthened the failing requirements.
        in_space: after a plan in continuous space, with small violations.
        delays: after a plan without the delay tolerance.
        least: seconds for all of them together if they are wanted but not required, or ``times`` those of the first.
        least_work: units for each of them, or ``times`` those of the first.
    """

    repairs: tuple[Attempt, ...] = (
        Attempt(_NONE, 1 / 64, 0, repaired=True),
        Attempt(_FAILING, 0.0, 0, repaired=True),
        Attempt(_FAILING, 1 / 64, 0, repaired=True),
        Attempt(_NONE, 1 / 16, 0, repaired=True),
    )
    on_roadmaps: tuple[Attempt, ...] = (
        Attempt(_NONE, 1 / 32, 0),
        Attempt(_FAILING, 0.0, 2, others=True),
        Attempt(_NONE, 1 / 8, 1),
    )
    in_space: tuple[Attempt, ...] = (
        Attempt(_NONE, 1 / 16, 0),
        Attempt(_ALL, 0.0, 0),
        Attempt(_FAILING, 1 / 16, 1),
        Attempt(_NONE, 1 / 8, 1, others=True),
        Attempt(_ALL, 1 / 16, 2),
        Attempt(_FAILING, 0.0, 2, others=True),
        Attempt(_NONE, 1 / 4, 3),
    )
    delays: tuple[Attempt, ...] = tuple(Attempt(_NONE, 0.0, seed, others=seed % 2 == 0) for seed in range(1, 8))
    least: float = 5.0
    times: float = 3.0
    least_work: float = 16.0


class RestrictedStage(Record):
    """Settings of a stage that replans with a decision of the previous plans forbidden.

    Args:
        least_work: units of work, or ``times`` those of the first plan if that is more.
    """

    least_work: float
    times: float

    def work_after(self, first: float) -> float:
        """Work limit in units after a first plan that took ``first`` units."""
        return max(self.least_work, self.times * first)


class ComparisonStage(RestrictedStage):
    """Settings of the comparison of disjuncts; the work is that of all plans together.

    Args:
        most: maximum number of plans.
        bounded: number of a plan's disjuncts and orders with a lower bound.
    """

    least_work: float = 8.0
    times: float = 1.0
    most: int = 3
    bounded: int = 16


class MarginsStage(RestrictedStage):
    """Wider margins of the verified plan; the work is that of all tries together.

    Args:
        tries: maximum number of tries; each strengthens the requirements that the one before violates between samples.
        share: largest share of the work for one try.
    """

    least_work: float = 4.0
    times: float = 0.5
    tries: int = 2
    share: float = 0.6


class AlternativesStage(RestrictedStage):
    """Settings of the search for alternative plans; the work is that of each attempt.

    Args:
        least_tries: minimum number of attempts for each further plan, so that the best of several are kept.
        tries: maximum number of attempts for each further plan.
        seeds: number of other seeds if no restriction is left.
    """

    least_work: float = 4.0
    times: float = 3.0
    least_tries: int = 2
    tries: int = 5
    seeds: int = 2


COMPARISON, MARGINS, ALTERNATIVES = ComparisonStage(), MarginsStage(), AlternativesStage()
SEARCH, COVERS, BOUND = SearchStage(), CoverStage(), BoundStage()
TIME_SCALING, CONTINUOUS_TIME = TimeScalingStage(), ContinuousTimeStage()


class Try(Record, eq=False):
    """One attempt of the search, with its speed, robustness margin and work.

    Args:
        mission: mission at the attempt's speeds.
        speed: fraction of the vehicles' speed; 0 for rest-to-rest speeds, None for those of the dynamics.
        margin: fraction of the robustness margin.
        work: work limit.
    """

    mission: Mission
    speed: float | None
    margin: float
    work: float


LAST_TRY = "speed limits of the mission, no robustness margin"


def speed_limited(
    mission: Mission, kernel: Kernel, speed_fraction: float, stretched: bool
) -> list[tuple[float, Mission]]:
    """The mission with speeds that its vehicles can fly, slowest first; empty if its own speeds are flyable.

    Args:
        speed_fraction: fraction of the vehicles' top speeds; below 1, the only one.
        stretched: True if the user has chosen the time scaling, so that only rest-to-rest speeds are tried.

    Returns:
        ``(fraction, mission)``; fraction 0 for rest-to-rest speeds.
    """
    shares: tuple[float, ...] = (
        (speed_fraction,) if speed_fraction < 1 else (0.0, *(() if stretched else SEARCH.speeds))
    )
    found: list[tuple[float, Mission]] = []
    for share in shares:
        pace = with_flyable_speeds(mission, share or None)
        if pace is not mission and (not found or _speeds(pace) > _speeds(found[-1][1])):
            found.append((share, pace))
    return [each for each in found if not has_errors(check_world(each[1], kernel))]


def _speeds(mission: Mission) -> float:
    return sum(float(agent.dynamics.top_speed) for agent in mission.agents)


def tries(mission: Mission, paces: Sequence[tuple[float, Mission]], margin: Metres, speed_fraction: float) -> list[Try]:
    """Attempts of the search before the last one, which has no margin and the mission's own speeds.

    The slowest speed comes first, then one halfway to the fastest, and the fastest. A single speed, and the fastest,
    are also tried with smaller margins.
    """
    own: list[tuple[float | None, Mission]] = [*paces] or [(None, mission)]
    slow, *faster = [own[at] for at in sorted({0, len(own) // 2, len(own) - 1})]

    def at(pace: tuple[float | None, Mission], part: float, work: float) -> Try:
        return Try(pace[1], pace[0], part, work)

    if speed_fraction < 1:
        planned = [at(slow, 1.0, SEARCH.work)]
    elif not faster:
        planned = [at(slow, part, SEARCH.work) for part in SEARCH.margins]
    else:
        planned = [at(slow, 1.0, SEARCH.work), *(at(pace, 1.0, SEARCH.work / 2) for pace in faster)]
        planned.append(at(faster[-1], 0.0, SEARCH.work / 2))
    return _before_last(planned, mission, margin)


def urgent_tries(mission: Mission, paces: Sequence[tuple[float, Mission]], margin: Metres, engine: str) -> list[Try]:
    """Attempts for agents in flight, after a search without a margin: at the slowest and the fastest speed.

    On roadmaps agents start at full speed, so slow plans are flown unchanged. ``clot`` plans flyable speeds.
    """
    own: list[tuple[float | None, Mission]] = [*paces] or [(None, mission)]
    ends = [own[0], *own[1:][-1:]]
    ordered = ends[::-1] if engine == CLOT.name else ends
    return _before_last([Try(pace, share, 1.0, SEARCH.work) for share, pace in ordered], mission, margin)


def _before_last(planned: Sequence[Try], mission: Mission, margin: Metres) -> list[Try]:
    """The attempts before the first one that has the mission's own speeds and no margin."""
    last = (at for at, each in enumerate(planned) if each.mission is mission and (margin <= 0 or each.margin == 0.0))
    return list(planned[: next(last, len(planned))])


def attempts(engine: str, delays: bool, repairable: bool) -> tuple[Attempt, ...]:
    """Attempts to find a plan that satisfies the requirements in continuous time, or that has the delay tolerance.

    Args:
        engine: engine of the first plan.
        delays: True if the delay tolerance is missing.
        repairable: True if the first plan can be repaired.
    """
    if delays:
        return CONTINUOUS_TIME.delays
    anew = CONTINUOUS_TIME.on_roadmaps if plans_on_roadmaps(engine) else CONTINUOUS_TIME.in_space
    return (*CONTINUOUS_TIME.repairs, *anew) if repairable else anew


def widens(checked: Checked, request: PlanRequest) -> bool:
    """Return whether the margins of a verified plan are widened.

    They are not if the plan has to follow the mission's own roadmap or to be the solver's, a published method or an
    extension made it, or the objective is the margin.
    """
    mission, choice = checked.valid_mission, checked.choice
    built_in = {name for name, _ in BACKENDS.items_built_in()}
    return (
        choice is not None
        and built_in.issuperset(choice.engines)
        and all(need.feature in CLOT.features | {Feature.HOPS} for need in needs(mission))
        and mission.objective is not Objective.ROBUSTNESS
        and not request.options.require_solver
        and not is_published(choice.engines, request.options)
    )


class Stage(Record):
    """One stage of the printed strategy: its name, its condition, its attempts in order, and the actions after
    outcomes.
    """

    name: str
    runs: str
    tries: tuple[str, ...]
    then: tuple[tuple[str, str], ...]


NEXT = "the next stage"
"""Placeholder for the name of the next stage; after the last stage, the plan is the answer."""


def stages(checked: Checked, request: PlanRequest) -> list[Stage]:
    """Stages of the printed strategy, in order, for a checked mission with a choice of engines."""
    found = list(_stages(checked, request))
    names = [each.name for each in found if each.name != "explain"]
    following = dict(zip(names, [*names[1:], "result"], strict=True))
    return [
        replace(each, then=tuple((why, after.replace(NEXT, following.get(each.name, ""))) for why, after in each.then))
        for each in found
    ]


def _stages(checked: Checked, request: PlanRequest) -> Iterator[Stage]:
    mission, kernel, choice, options = checked.valid_mission, checked.valid_kernel, checked.choice, request.options
    assert choice is not None
    if is_published(choice.engines, options):
        after = (("plan", NEXT), ("no plan", "undecided"))
        yield Stage("search", f"{choice.engines[0]} with the method of the preset", (), after)
        yield Stage("verify", "always", (), (("passed", NEXT), ("failed", "undecided")))
        return
    margin = tracking_margin(mission) if options.margin is None else Metres(options.margin)
    room = with_vehicle_room(mission)
    paces = speed_limited(room, kernel, 1.0, stretched=options.stretch != 1)
    before = tries(room, paces, margin, 1.0)
    several = len(choice.engines) > 1
    explain = "explain" if request.explain_limit else "result"
    yield Stage(
        "search",
        " and ".join(choice.engines) + (f" in turns of {FIRST:g}, {FIRST * LONGER:g}, … units" if several else ""),
        (
            *(f"{try_text(each, margin)}; {_limit(each)}" for each in before),
            f"{LAST_TRY}; remaining time",
        ),
        (
            ("plan", NEXT),
            *(
                (("no plan in a try", f"over-approximations for {COVERS.first:g} units, then the next try"),)
                if before
                else ()
            ),
            ("no plan in the last try", f"over-approximations for {COVERS.failed:g} units, then {explain}"),
            ("mission proved infeasible", explain),
        ),
    )
    tolerant = (("delays not tolerated", "continuous time"),) if mission.tolerances else ()
    failed = "search by the other backends" if several else "result: bug of the compiler"
    yield Stage("verify", "always", (), (("passed", NEXT), ("failed", failed), *tolerant))
    if not BACKENDS[choice.engines[0]].optimises_globally and mission.objective is not Objective.NONE:
        better = (("always", f"{NEXT}, with the best plan by the objective"),)
        limit = f"at most {COMPARISON.most} plans, {_work(COMPARISON)} in all"
        yield Stage("options", f"if the backend chose disjuncts by an estimate; {limit}", ("other options",), better)
    if options.stretch == 1:
        slower = tuple(f"{fraction:.0%} of the vehicles' speed" for fraction in TIME_SCALING.fractions)
        after = (("flyable plan", NEXT), ("none", "result: plan cannot be flown"))
        yield Stage("time scaling", f"if the plan exceeds vehicle limits; {_seconds(TIME_SCALING)}", slower, after)
    if request.continuous_time is not ContinuousTime.AT_STEPS:
        wanted = request.continuous_time is ContinuousTime.WANTED
        limit = _seconds(CONTINUOUS_TIME) if wanted else "remaining time"
        last = f"{NEXT}, with the first plan and a warning" if wanted else "result: no plan in continuous time"
        yield Stage(
            "continuous time",
            f"if a requirement is violated between samples; {limit}",
            tuple(map(str, attempts(choice.engines[0], delays=False, repairable=True))),
            (("plan in continuous time", NEXT), ("none", last)),
        )
    if widens(checked, request):
        limits = clot_settings(mission).shortening
        yield Stage(
            "margins",
            f"if a normalised margin is well below {limits.margin:g}, also before continuous time; {_work(MARGINS)}",
            (f"polishes for wider margins, at most {limits.longer_margin:.0%} longer",),
            (("wider plan that passes verification", NEXT), ("none", f"{NEXT}, with the plan before")),
        )
    if request.alternatives > 1:
        best = (("always", "result: best plan and other plans"),)
        most = ALTERNATIVES.tries * (request.alternatives - 1)
        limit = f"at most {most} attempts, {_work(ALTERNATIVES)} each"
        runs = f"until {request.alternatives} different plans are found; {limit}"
        yield Stage("alternatives", runs, ("missions that forbid a choice of earlier plans",), best)
    if request.explain_limit:
        changes = ("fewer requirements, wider windows and limits, more time, another roadmap",)
        limit = f"{request.explain_limit:g} s"
        yield Stage("explain", f"if there is no plan; {limit}", changes, (("always", "result with its causes"),))


def _work(stage: RestrictedStage) -> str:
    return f"{stage.least_work:g} units, or {stage.times:g} times the work of the first plan if more"


def _seconds(stage: TimeScalingStage | ContinuousTimeStage) -> str:
    return f"{stage.least:g} s, or {stage.times:g} times the time of the first plan if more"


def _speed(each: Try) -> str:
    if each.speed is None:
        return "speed limits of the mission"
    return f"{each.speed:.0%} of the vehicles' speed" if each.speed else "speeds flyable from rest to rest"


def try_text(each: Try, margin: Metres) -> str:
    """Text for an attempt's speed and robustness margin."""
    kept = each.margin * margin
    return f"{_speed(each)}, {f'robustness margin {kept:.3g} m' if kept > 0 else 'no robustness margin'}"


def _limit(each: Try) -> str:
    return f"{each.work:g} units, {SEARCH.time:.0%} of the remaining time"


def show_strategy(checked: Checked, request: PlanRequest) -> str:
    """Strategy as text: numbered stages, each followed by its attempts and the actions after each outcome."""
    lines: list[str] = []
    for number, stage in enumerate(stages(checked, request), 1):
        lines.append(f"{number} {stage.name}: {stage.runs}")
        lines += [f"  {number}.{at} {each}" for at, each in enumerate(stage.tries, 1)]
        lines += [f"  {outcome} -> {following}" for outcome, following in stage.then]
    return "\n".join(lines) + "\n"
