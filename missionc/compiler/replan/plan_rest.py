"""Planning of a remaining mission: with few changed agents near the flown plan, else with all agents from rest.

    in   the remaining mission, the motion until it begins, the flown plan
    out  Replanned

Few agents change in motion while all others follow their plan. Candidates near the flown plan bring all remaining
agents back onto it, or let one of them replace a lost one. An agent returns straight to the plan as soon as possible,
without other tests. The candidate with the fewest violations comes first; candidates need not be feasible.

All libraries for replanning are loaded before the clock runs, since that takes seconds.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from missionc.backends.acceptance import attempt
from missionc.backends.api import Backend, Budget, Impossible
from missionc.backends.choose_backend import choose_backend
from missionc.backends.load import load_engines, load_repair, load_roadmaps, load_straighten
from missionc.backends.registry import BACKENDS
from missionc.backends.smt.spec import SMT
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.trace import Array, Trace
from missionc.compiler import driver
from missionc.compiler.ask_cover import CoverSide
from missionc.compiler.front_end import Checked
from missionc.compiler.no_plan import impossible
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.replan.cannot_replan import no_plan_in_time
from missionc.compiler.replan.request import Flying, Replanned, Request, Way
from missionc.compiler.replan.stop_all import Stopped
from missionc.compiler.results import Compiled, Verified
from missionc.geometry.curves.piecewise_polynomials import written
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.planning.progression.rest_of_mission import slowed
from missionc.verification.monitoring.monitor import monitor

MOST = 60
"""Maximum number of candidate trajectories near the plan that are compared."""


def near_motions(
    mission: Mission, kernel: Kernel, plan: Trace, left: Sequence[int], lost: Sequence[int], starts: Array
) -> list[Trace]:
    """Candidate trajectories near the plan, sorted by the number of violated requirements, then by the worst violation.

    Args:
        plan: flown plan of all agents, including lost ones, over the remaining steps.
        left, lost: indices of the remaining and of the lost agents.
        starts: positions of the remaining agents, (agents, dim), metres.
    """
    own = [_way(mission, index, plan.position[row], starts) for index, row in enumerate(left)]
    found = [_motion(plan, left, own)]
    for index, gone in _substitutes(plan, left, lost, starts):
        rows, ways = list(left), list(own)
        rows[index], ways[index] = gone, _way(mission, index, plan.position[gone], starts)
        found.append(_motion(plan, rows, ways))
    return sorted(found, key=lambda trace: _failing(mission, kernel, trace)) if len(found) > 1 else found


def _substitutes(plan: Trace, left: Sequence[int], lost: Sequence[int], starts: Array) -> list[tuple[int, int]]:
    """Pairs of a remaining agent and a lost agent that it may replace, nearest first.

    Args:
        starts: positions of the remaining agents, (agents, dim), metres.
    """
    pairs = [(index, gone) for gone in lost for index in range(len(left))]
    pairs.sort(key=lambda pair: float(np.linalg.norm(starts[pair[0]] - plan.position[pair[1], 0])))
    return pairs[: MOST - 1]


def _way(mission: Mission, index: int, wanted: Array, starts: Array) -> Array:
    """Path from an agent's start at top speed straight onto a wanted path, and then along it: (steps, dim), metres.

    Args:
        wanted: (steps, dim), metres.
        starts: positions of all agents, (agents, dim), metres.
    """
    reach = mission.agents[index].dynamics.top_speed * float(mission.step)
    position = wanted.copy()
    position[0] = starts[index]
    for step in range(1, len(position)):
        way = wanted[step] - position[step - 1]
        far = float(np.linalg.norm(way))
        position[step] = position[step - 1] + way * min(1.0, reach / far if far else 1.0)
    return position


def _motion(plan: Trace, rows: Sequence[int], ways: Sequence[Array]) -> Trace:
    """Trace of agents on the given paths, with the headings of the plan's agents.

    Args:
        rows: index in the plan for each path.
        ways: paths, (steps, dim) each, metres.
    """
    position = np.stack(ways)
    velocity = np.zeros_like(position)
    velocity[:, :-1] = np.diff(position, axis=1) / plan.step
    return Trace(plan.step, position, velocity, plan.heading[list(rows)])


def _failing(mission: Mission, kernel: Kernel, trace: Trace) -> tuple[int, float]:
    judged = monitor(mission, kernel, trace).requirements
    return sum(not each.satisfied for each in judged), -min((each.robustness for each in judged), default=0.0)


def get_ready(flying: Flying) -> None:
    """Load the modules for replanning a flight: engines, post-optimisation, and fitting and writing of trajectories."""
    choice, _ = choose_backend(flying.checked.valid_mission, None)
    for engine in choice.engines if choice else ():
        load_engines((engine,))
        if engine in BACKENDS:
            load_straighten(engine)
    load_repair(flying.trace)
    import missionc.backends.smt.backend
    import missionc.flight.trajectories.crazyflie
    import missionc.output.output_files  # noqa: F401


QUICK, QUICKLY = 0.1, 0.3
"""Work units and fraction of the time in which covers may prove infeasibility before a search."""
SAME = 1e-6
"""Deviation in metres up to which an agent counts as following its plan."""
REPAIRED = 2
"""Maximum number of candidate trajectories near the plan that are repaired."""
ROADMAPS, REPAIR = 0.6, 0.4
"""Fraction of the time for roadmaps, and fraction of the remaining time for repair, before all engines are used."""


class RestPlanner(Record, eq=False):
    """Planner for the rest of a mission in flight.

    Args:
        plan: flown plan from its beginning: (agents, steps + 1).
        names: names of its agents.
        left: indices of the remaining agents.
        deadline: end on the clock of ``time.monotonic``.
    """

    plan: Trace
    names: tuple[str, ...]
    left: tuple[int, ...]
    request: Request
    limits: Limits
    deadline: float

    @property
    def budget(self) -> Budget:
        return Budget(self.deadline, seed=self.request.seed, limits=self.limits, urgent=True)

    def by_few(self, rest: Checked, stopped: Stopped, share: float) -> Replanned | None:
        """Plan in which few agents change while in motion, or a proof of infeasibility.

        None if neither is found within a fraction ``share`` of the time.
        """
        rest = _told(rest, self.stops(stopped))
        refused = self._refuted(rest)
        if refused is not None:
            return self._ended(Way.NONE, rest, refused, stopped)
        now = time.monotonic()
        until = now + share * (self.deadline - now)
        tried: list[frozenset[int]] = []
        near = self._near(rest, stopped)[:REPAIRED]
        for number, motion in enumerate(near):
            free = self._changing(rest, motion, self._ahead(stopped))
            asked = _with_courses(rest, motion, free)
            for backend in (load_repair(motion), load_roadmaps() if len(free) < len(self.left) else None):
                now = time.monotonic()
                if backend is None or free in tried or now >= until:
                    continue
                budget = replace(self.budget, deadline=now + (until - now) / (len(near) - number + 1))
                compiled = driver.plan_once(asked, self._asked(budget, backend))
                if isinstance(compiled.outcome, Verified):
                    return self._ended(Way.REPAIRED, rest, compiled, stopped, free)
            tried.append(free)
        return None

    def _changing(self, rest: Checked, motion: Trace, before: Trace) -> frozenset[int]:
        """Indices of the remaining agents that leave the plan, or violate something, in a candidate trajectory."""
        come_to = attempt(rest.valid_mission, rest.valid_kernel, motion)
        named = {name for fault in come_to.faults for name in fault.agents}
        named |= {name for judged in come_to.violated for name in judged.agents}
        off = np.abs(motion.position - before.position[list(self.left)]).max(axis=(1, 2))
        return frozenset(
            agent.index for agent in rest.valid_mission.agents if agent.name in named or off[agent.index] > SAME
        )

    def by_all(self, rest: Checked, stopped: Stopped, *, refute: bool) -> Replanned:
        """Plan in which all agents start from rest: near the old plan, or new.

        Args:
            refute: True to try covers for a proof of infeasibility first.
        """
        rest = _told(rest, self.stops(stopped))
        refused = self._refuted(rest) if refute else None
        if refused is not None:
            return self._ended(Way.NONE, rest, refused, stopped)
        soon = self._on_roadmaps(rest)
        if soon is not None and (isinstance(soon.outcome, Verified) or self.request.hurried):
            return self._ended(Way.ANEW, rest, soon, stopped)
        way, compiled = Way.REPAIRED, self._repaired(rest, stopped)
        if compiled is None:
            way = Way.ANEW
            compiled = driver.plan(rest, self._asked(self.budget))
        return self._ended(way, rest, compiled, stopped)

    def _asked(self, budget: Budget, backend: Backend | None = None) -> PlanRequest:
        return PlanRequest(budget, self.request.options, exports=self.request.exports, backend=backend)

    def stops(self, stopped: Stopped) -> dict[str, str]:
        """Text of each agent's polynomials until the rest begins, by agent name."""
        return {self.names[agent]: written(own) for agent, own in zip(self.left, stopped.pieces, strict=True)}

    def _ended(
        self, way: Way, rest: Checked, compiled: Compiled, stopped: Stopped, changed: Collection[int] | None = None
    ) -> Replanned:
        stops = self.stops(stopped)
        if isinstance(compiled.outcome, Verified):
            rows = range(len(self.left)) if changed is None else sorted(changed)
            who = tuple(self.names[self.left[row]] for row in rows)
            return Replanned(way, compiled.findings, rest, None, compiled, stopped.until, who, stops)
        findings, outcome = no_plan_in_time(rest, compiled), compiled.outcome
        cannot = outcome.conflict[:1] if isinstance(outcome, Impossible) else ()
        ended = Replanned(Way.NONE, findings, rest, compiled=compiled, begins=stopped.until)
        return replace(ended, stops=stops, cannot=cannot)

    def _refuted(self, rest: Checked) -> Compiled | None:
        """Compilation with a proof of infeasibility, which saves the search; None if little work finds no proof."""
        ahead = looking_ahead(rest.valid_mission, rest.valid_kernel, self.limits.formula_nodes)
        if isinstance(ahead, TooLarge):
            return None
        now = time.monotonic()
        soon = replace(self.budget, deadline=now + QUICKLY * (self.deadline - now))
        refused = CoverSide(rest.valid_mission, ahead, rest.valid_kernel, self.request.options, soon).refusal(QUICK)
        if refused is None:
            return None
        return Compiled(rest, refused, (*rest.findings, impossible(rest.valid_mission, refused, None)), ())

    def _on_roadmaps(self, rest: Checked) -> Compiled | None:
        """Compilation with a plan on roadmaps, or infeasible on them, within a fraction of the time; else None."""
        if rest.choice is None or SMT.name not in rest.choice.engines:
            return None
        now = time.monotonic()
        soon = replace(self.budget, deadline=now + ROADMAPS * (self.deadline - now))
        compiled = driver.plan_once(rest, self._asked(soon, load_roadmaps()))
        return compiled if isinstance(compiled.outcome, Verified | Impossible) else None

    def _repaired(self, rest: Checked, stopped: Stopped) -> Compiled | None:
        """Compilation with a trajectory near the old plan, optimised to satisfy the rest; None if there is none."""
        now = time.monotonic()
        until = now + REPAIR * (self.deadline - now)
        for motion in self._near(rest, stopped)[:REPAIRED]:
            now = time.monotonic()
            more = replace(self.budget, deadline=now + (until - now) / 2 if self._lost else until)
            compiled = driver.plan_once(rest, self._asked(more, load_repair(motion)))
            if isinstance(compiled.outcome, Verified):
                return compiled
        return None

    @property
    def _lost(self) -> list[int]:
        return [agent for agent in range(len(self.names)) if agent not in self.left]

    def _ahead(self, stopped: Stopped) -> Trace:
        """Part of the flown plan from the beginning of the rest."""
        return self.plan.part(range(len(self.names)), stopped.step, self.plan.position.shape[1] - 1)

    def _near(self, rest: Checked, stopped: Stopped) -> list[Trace]:
        """Candidate trajectories near the old plan, from the positions at the beginning of the rest."""
        starts = np.array([agent.start.point for agent in rest.valid_mission.agents if agent.start.point is not None])
        return near_motions(rest.valid_mission, rest.valid_kernel, self._ahead(stopped), self.left, self._lost, starts)


def _with_courses(rest: Checked, motion: Trace, free: Collection[int]) -> Checked:
    """Remaining mission with fixed trajectories for all agents that are not ``free``."""
    agents = tuple(
        agent
        if agent.index in free
        else replace(agent, course=tuple(map(tuple, motion.position[agent.index].tolist())))
        for agent in rest.valid_mission.agents
    )
    return replace(rest, mission=replace(rest.valid_mission, agents=agents))


def _told(rest: Checked, stops: Mapping[str, str]) -> Checked:
    """Remaining mission with the stops before it, and with agents no faster than the polynomials allow."""
    speeds = {agent.name: agent.vehicle.speed for agent in rest.valid_mission.agents}
    return replace(rest, mission=slowed(rest.valid_mission, speeds), stops=tuple(stops.items()))
