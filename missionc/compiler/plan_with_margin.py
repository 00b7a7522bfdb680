"""Planning with a robustness margin first, for flights that miss their plan a little; then without.

in   a backend, Mission, Kernel, Options, Budget
out  its Outcome
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

from missionc.backends import api
from missionc.backends.clot.offer import CLOT
from missionc.backends.load import load_straighten
from missionc.backends.options import Options
from missionc.base.diagnostics.model import has_errors
from missionc.base.units import Metres
from missionc.compiler.ask_cover import LITTLE, CoverSide
from missionc.frontend.checks.check_world import check_world
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.normal_form import constant
from missionc.ir.kernel.walk import reads_headings
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.ahead_of_time import ahead_of_time, with_room_for_delays
from missionc.ir.lower.tighten import tightened, tracking_margin, with_flyable_speeds, with_vehicle_room
from missionc.ir.lower.unroll_past import looking_ahead

PARTS = (1.0, 0.5, 0.0)
"""Parts of the margin: where all of it is too much, half of it is better than none."""

SHARE, WORK = 0.25, 16.0
"""A share of the time that is left, and at most so many units of ``work``, for a plan that has a margin."""

URGENT, MOST_OF_IT = 10.0, 0.75
"""Seconds; where less are left, the share of them that such a try has: there is time for one."""

AT_ONCE = 0.4
"""The share where somebody is in flight who waits."""

FASTER = (0.4, 0.55, 0.7, 0.85, 1.0)
"""Shares of what vehicles fly under way: where nobody is in time at the speeds that can be flown from rest to rest."""

ROOM = (1.0, 0.5, 0.25, 0.0)
"""Shares of the room that the delays take at most: whoever is late seldom needs all of it."""


def plan_with_margin(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    *,
    covers: bool = False,
    calm: float = 1.0,
) -> api.Outcome:
    """A plan of ``_plan_with_margin``; where delays are to be tolerated, one that tolerates them if any is found.

    Args:
        covers: whether covers are asked if any motion is a plan, where none is found at once.
        calm: below 1, no plan is looked for that is faster than this share of what vehicles do at most.
    """
    return _tolerant(backend, mission, kernel, options, budget, calm) or _plan_with_margin(
        backend, mission, kernel, options, budget, covers=covers, calm=calm
    )


def _tolerant(
    backend: api.Backend, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget, calm: float
) -> api.Planned | None:
    """A plan that is ahead of time, with room for those who are late; None where none of them tolerates the delays.

    At the speeds that vehicles fly whoever is late has less of a way to make up for than at those of the dynamics.
    """
    if not mission.tolerances:
        return None
    from missionc.verification.verify_plan import verify  # what judges plans loads scipy

    early = ahead_of_time(mission, kernel)
    flown = with_flyable_speeds(mission, min(calm, FASTER[-1]))
    paces = (flown,) if calm < 1 or flown is mission else (flown, mission)
    for pace, share in product(paces, ROOM):
        roomy = with_room_for_delays(pace, share)
        if share and has_errors(check_world(roomy, early)):
            continue
        outcome = _plan_with_margin(
            backend, roomy, early, options, replace(_short(budget, WORK), found=api.discard_plan)
        )
        if isinstance(outcome, api.Planned) and verify(mission, kernel, outcome.trace).passed:
            extra = roomy.separation - mission.separation
            room = f", and with {extra:.3g} m more between bodies" if extra else ""
            return outcome.noting(f"planned early{room}, so that it tolerates the delays")
    return None


def _plan_with_margin(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    *,
    covers: bool = False,
    calm: float = 1.0,
) -> api.Outcome:
    """A plan that its vehicles can fly and that keeps every requirement by the margin, or by a part of it; else any.

    Only a refusal of the mission itself is one: that of the tightened mission
    says nothing. What is kept of the run, to be taken up again, is of the last
    try. A plan after a try that time ended is cut short: with more, that try may
    have found another.
    """
    ahead = looking_ahead(mission, kernel, budget.limits.formula_nodes)
    if isinstance(ahead, TooLarge):
        return api.NotFound(api.Reason.SIZE, _too_large(ahead, budget.limits.formula_nodes), api.Report())
    kernel, meant = ahead, kernel
    cover = CoverSide(mission, kernel, meant, options, budget) if covers and not budget.urgent else None
    never = next((goal.name for goal in kernel.requirements if constant(goal.formula) is False), None)
    if never is not None:
        refused = cover.refusal(LITTLE) if cover is not None else None
        return refused or api.Impossible(
            (never,), "it is false whatever the motion", api.Report(), api.Scope.MISSION, smallest=True
        )
    wanted = room = with_vehicle_room(mission)
    paces = _paces(wanted, kernel, calm, FASTER if options.stretch == 1 else ())
    if calm < 1:
        if not paces:
            return api.NotFound(api.Reason.SOLVER, "nobody would be in time who is slower", api.Report())
        wanted = paces[0]
    margin = tracking_margin(mission) if options.margin is None else Metres(options.margin)
    late = False
    tries = _tries(paces or [wanted], margin, calm)
    soonest: api.Planned | None = None
    if budget.urgent:
        first = _planned(backend, wanted, kernel, options, replace(budget, found=api.discard_plan))
        if not isinstance(first, api.Planned):
            return first  # with a margin there is no plan then either
        soonest, tries = first, _soonest(paces or [wanted], backend)
        budget.found(_noted(first, margin, 0.0) if margin > 0 else first)
    for pace, part, work in tries:
        if pace is wanted and (margin <= 0 or part == 0.0):
            break
        tight = tightened(pace, kernel, Metres(part * margin))
        fastest = with_flyable_speeds(room, FASTER[-1]) if pace is not room else room
        outcome = _planned(backend, *tight, options, _short(budget, work), under_way=fastest)
        if isinstance(outcome, api.Planned):
            return _after(outcome if part == 1.0 or margin <= 0 else _noted(outcome, margin, part), late)
        late = late or (isinstance(outcome, api.NotFound) and outcome.reason is api.Reason.TIME)
        refused = cover.refusal(LITTLE, outcome.report) if cover is not None else None
        if refused is not None:
            return refused
    outcome = soonest or _planned(backend, wanted, kernel, options, budget, cover)
    if not isinstance(outcome, api.Planned):
        return outcome
    return _after(_noted(outcome, margin, 0.0) if margin > 0 else outcome, late)


def _short(budget: api.Budget, work: float) -> api.Budget:
    """A ``SHARE`` of the time that is left, and so many units of work at most, for a try that is not kept."""
    left = budget.deadline - time.monotonic()
    share = AT_ONCE if budget.urgent else MOST_OF_IT if left < URGENT else SHARE
    deadline = budget.deadline - (1 - share) * left
    return replace(budget, deadline=deadline, work=work, keep=api.discard_snapshot, resume=None)


def _paces(mission: Mission, kernel: Kernel, calm: float, faster: Sequence[float]) -> list[Mission]:
    """The mission at speeds at which its vehicles fly, from the slowest on at which agents can be in time; none where
    there is nothing to slow down.

    Args:
        calm: below 1, the share of what vehicles do at most that is the only one.
        faster: further shares, as of ``with_flyable_speeds``.
    """
    shares = (calm,) if calm < 1 else (None, *faster)
    found: list[Mission] = []
    for pace in (with_flyable_speeds(mission, share) for share in shares):
        if pace is not mission and (not found or _top(pace) > _top(found[-1])):
            found.append(pace)
    return [each for each in found if not has_errors(check_world(each, kernel))]


def _top(mission: Mission) -> float:
    return sum(float(agent.dynamics.top_speed) for agent in mission.agents)


def _tries(paces: Sequence[Mission], margin: Metres, calm: float) -> list[tuple[Mission, float, float]]:
    """At which pace, with which part of the margin and how much work a plan is looked for.

    The slowest comes first, then one halfway to the fastest, and the fastest. Of one pace alone, and of the fastest,
    plans are looked for with less of the margin too.
    """
    slow, *faster = [paces[at] for at in sorted({0, len(paces) // 2, len(paces) - 1})]
    if calm < 1:
        return [(slow, 1.0, WORK)]
    if not faster:
        return [(slow, part, WORK) for part in PARTS]
    return [(slow, 1.0, WORK), *((pace, 1.0, WORK / 2) for pace in faster), (faster[-1], 0.0, WORK / 2)]


def _soonest(paces: Sequence[Mission], backend: api.Backend) -> list[tuple[Mission, float, float]]:
    """Likewise where somebody is in flight who waits: at the slowest pace and the fastest.

    On roadmaps agents are at full speed at once: slow plans are flown as they are. Transport keeps to what is flown.
    """
    ends = [paces[0], *paces[1:][-1:]]
    return [(pace, 1.0, WORK) for pace in (ends[::-1] if backend.name == CLOT.name else ends)]


def _too_large(ahead: TooLarge, room: int) -> str:
    return (
        f"operators of the past, spelt out step by step, come to {ahead.nodes} parts or more; the limit is {room}"
        " (`--limit formula_nodes=VALUE`)"
    )


def _planned(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    cover: CoverSide | None = None,
    under_way: Mission | None = None,
) -> api.Outcome:
    """What a backend says. A plan of a portfolio that comes from a roadmap is straightened, but for the user's own.

    Nor is one that asks for headings: who stands and faces has a heading on the roadmap, and none in motion.

    Args:
        under_way: as fast as agents may be once it is straightened: who sets out gently makes up for it later.
    """
    if cover is None:
        outcome = backend.plan(mission, kernel, options, budget)
    else:
        outcome = cover.searched(backend, mission, kernel, budget)
    if not isinstance(outcome, api.Planned):
        return outcome
    straighten = load_straighten(outcome.report.engine)
    if straighten is None or mission.solve.roadmap is not None or reads_headings(kernel):
        return outcome
    return straighten(replace(mission, agents=(under_way or mission).agents), kernel, outcome, budget)


def _after(planned: api.Planned, late: bool) -> api.Planned:
    """The plan as it is given out, where a try before it may have been ``late``."""
    if not late or planned.report.cut_short:
        return planned
    return replace(planned, report=replace(planned.report, cut_short=api.CutShort.TIME))


def _noted(planned: api.Planned, margin: Metres, part: float) -> api.Planned:
    achieved = f"; this one keeps them by {part * margin * 100:g} cm" if part else ""
    note = f"no plan was found that keeps the requirements by {margin * 100:g} cm, the margin of a flight{achieved}"
    return replace(planned, report=replace(planned.report.noting(note), kept=part))
