"""Retiming of trajectories: the same paths with new velocity profiles, so that agents with slack rest.

    in   a plan's control points, trajectory and goals
    out  control points and trajectory, those of another plan along the same paths if it has more rest

An agent that creeps, or need not move, gets another velocity profile along its path (``path_velocity``): first all
agents of a formation together, then one after the other. Conditions that imply the goals must be satisfied at their
steps as well as before, and other margins must preserve their current fraction of the target.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import starmap

import numpy as np

from missionc.backends.clot.cost_weights import with_room
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.condition_values import ConditionValues
from missionc.backends.clot.optimise.convex_descent import Vicinity
from missionc.backends.clot.optimise.motion_residuals import OBSTACLES, SEPARATION, Costs
from missionc.backends.clot.optimise.path_velocity import (
    SPEEDS,
    Bounds,
    Nodes,
    lengths,
    path_nodes,
    path_velocity,
    restlessness,
)
from missionc.backends.clot.optimise.residuals import Rows
from missionc.backends.clot.optimise.turning import TURN
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices, Trace
from missionc.geometry.dynamics import can_wait, turn_in_step
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.analysis import about_whom
from missionc.ir.kernel.nodes import Atom, Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import postorder

ROUNDING = 1e-9
"""Rounding tolerance of lengths, metres."""


def retime(
    control: Array,
    made: Trace,
    demand: Demand,
    costs: Costs,
    accept: Callable[[Array], Trace | None],
    go_on: Callable[[], bool] = lambda: True,
) -> tuple[Array, Trace]:
    """Control points, (agents, points, dim), metres, and trace of a plan with more rest; the given plan's own if none
    is found.

    Args:
        demand: goals of the plan without fixed choices.
        accept: function from control points to their trace if it is an equally good plan, otherwise None.
    """
    count = len(control)
    everyone, singles = tuple(range(count)), [(agent,) for agent in range(count)]
    paces = (lengths(*_path(control, list(each), costs)) for each in (everyone, *singles))
    if _of_team(demand) and not any(map(_creeps, paces)):
        return control, made
    run = _Calm(control, demand, costs)
    if count > 1:
        run.tune(everyone)
        if run.control is not control:
            motion = accept(run.control)
            if motion is not None:
                control, made = run.control, motion
            run.control = control
    for single in singles:
        if go_on():
            run.tune(single)
    calm = run.control
    changed = np.flatnonzero((calm != control).any(axis=(1, 2)))
    motion = accept(calm) if changed.size else None
    if motion is not None:
        return calm, motion
    for agent in changed.tolist():
        tried = control.copy()
        tried[agent] = calm[agent]
        motion = accept(tried) if go_on() else None
        if motion is not None:
            control, made = tried, motion
    return control, made


class _Asked(Record, eq=False):
    """Single-step formula that must be true at some steps, (some,), for agents flagged in ``mask``, (agents, some).

    Args:
        about: agents whose trajectories matter, (agents,).
    """

    formula: Node
    steps: Indices
    mask: Flags
    order: Sequence[Node]
    about: Flags
    reads_speed: bool

    def worst(self, mission: Mission, position: Array, velocity: Array) -> Array:
        """Least robustness at the required agents for each of its steps, (batch, some), metres.

        Args:
            position: (agents, batch, steps, dim), metres; ``velocity`` likewise, m/s.
        """
        agents, batch, _, dim = position.shape
        there, going = (each[:, :, self.steps].reshape(agents, -1, dim) for each in (position, velocity))
        value = ConditionValues(mission, there, going).values(self.order)[self.formula]
        value = np.broadcast_to(value, (len(value), batch * len(self.steps))).reshape(len(value), batch, -1)
        mask = self.mask if len(value) > 1 else self.mask.any(axis=0, keepdims=True)
        return np.asarray(np.where(np.expand_dims(mask, 1), value, np.inf).min(axis=0))


def _asked(formula: Node, mask: Flags) -> _Asked:
    steps, order = np.flatnonzero(mask.any(axis=0)), postorder((formula,))
    about: Flags = np.asarray(about_whom((formula,), len(mask))[formula][:, mask.any(axis=1)].any(axis=1))
    reads_speed = any(each.predicate.reads_speed for each in order if isinstance(each, Atom))
    return _Asked(formula, steps, mask[:, steps], order, about, reads_speed)


def _of_team(demand: Demand) -> bool:
    """Return true if some condition is about the team as a whole."""
    return any(isinstance(node, Atom) and node.predicate.about_team for node in demand.order)


def _path(control: Array, members: list[int], costs: Costs) -> tuple[Array, Array]:
    """Control points of the agents ``members``, (members, points, dim), metres, and their step length at top speed,
    (members,), metres."""
    made, mission = costs.splines, costs.mission
    unit = np.array([mission.agents[each].dynamics.top_speed for each in members]) * made.step
    return control[members, : made.steps + 1 + bool(made.smooth[members[0]])], unit


def _creeps(pace: Array) -> bool:
    """Return true if speeds ``pace``, (steps,), as fractions of the top speed, are so low for so long that the agent
    may rest instead."""
    creep, share = 0.05, 0.1  # of the top speed; of the steps, from which an agent may rest instead
    return bool(((pace > 0) & (pace < creep)).sum() >= share * len(pace))


class _Need(Record, eq=False):
    """Goal with the single-step conditions that imply it, and its robustness, metres."""

    demand: Demand
    asked: tuple[_Asked, ...]
    worst: float


@dataclass(slots=True, eq=False)
class _Calm:
    """Plan's control points, (agents, points, dim), metres, that are retimed path by path."""

    control: Array
    demand: Demand
    costs: Costs
    vicinity: Vicinity = field(init=False)
    needs: list[_Need] = field(init=False)
    tight: Flags = field(init=False)
    """Steps at which a goal is satisfied without additional margin, (steps + 1,)."""
    apart: Array = field(init=False)
    """Required distance of two agents, (agents, agents), metres, after scaling each axis by ``metric``."""
    metric: Array = field(init=False)
    room: float = field(init=False)
    """Margin, metres, beyond which more margin does not count."""
    work: int = field(init=False)

    def __post_init__(self) -> None:
        mission, made, roots = self.costs.mission, self.costs.splines, self.demand.roots
        self.work = clot_settings(mission).shortening.retiming
        states = made.states(self.control)
        found = self.demand.witness(*states)
        choices = {key: chosen for key, chosen in found.items() if isinstance(key[0], WindowNode | UntilNode)}
        self.demand = Demand.of(mission, roots, choices, mission.steps)
        self.vicinity = Vicinity(self.control, self.costs, self.demand)
        self.needs = []
        for one in (Demand.of(mission, (root,), choices, mission.steps) for root in roots):
            about_steps = tuple(starmap(_asked, one.states_asked(*states).items()))
            self.needs.append(_Need(one, about_steps, one.worst(*states)))
        self.tight = np.zeros(mission.steps + 1, dtype=np.bool_)
        position, velocity = (each[:, None] for each in states)
        for need in self.needs:
            for asked in need.asked:
                self.tight[asked.steps[asked.worst(mission, position, velocity)[0] <= need.worst + ROUNDING]] = True
        self.apart, self.metric = _apart(self.costs, states[0])
        self.room = with_room(mission).task

    def tune(self, group: tuple[int, ...]) -> None:
        """Retime agents along their paths, with one velocity profile for all of them, if the result is equally good."""
        # Cells of a path in a step at top speed: with momentum 12 to 48, two for the gain of a step.
        plain, finer, finest = 6, 12, 48
        cuts = 8  # number of profiles tried, each without the violations of the previous one
        less = 0.5  # least number of steps gained by another profile
        settings = clot_settings(self.costs.mission).shortening
        mission, made, members = self.costs.mission, self.costs.splines, list(group)
        agents = [mission.agents[each] for each in group]
        smooth = bool(made.smooth[members[0]])
        if not all(can_wait(each.dynamics) for each in agents) or (made.smooth[members] != smooth).any():
            return
        path, unit = _path(self.control, members, self.costs)
        steps = lengths(path, unit)
        if not steps.any() or not (_creeps(steps) or self._may_stay(members, path[:, :1])):
            return
        gain = min(each.dynamics.top_acceleration * made.step / each.dynamics.top_speed for each in agents)
        fine = int(np.clip(np.ceil(2 / gain), finer, finest)) if smooth else plain
        nodes = path_nodes(path, unit, fine, np.append(self.tight, self.tight[-1:]) if smooth else self.tight)
        self.work -= len(nodes.along) * len(steps) * len(self.control)
        if self.work < 0:
            return
        cell = float(unit.max()) / (2 * fine) if smooth else 0.0
        forbidden: set[tuple[int, int]] = set()
        stops: dict[int, int] = {}
        bounds = Bounds(
            self._allowed(members, nodes.place, cell),
            unit,
            max(settings.top, float(steps.max())),
            settings.top * gain,
            1 + smooth,
            made.steps + smooth if made.rest is None else made.rest,
            any(each.finish is not None and each.finish.point is not None for each in agents),
            forbidden,
            stops,
        )
        for _ in range(cuts):
            found = path_velocity(nodes, bounds)
            if found is None or restlessness(lengths(nodes.place[:, found], unit)) > restlessness(steps) - less:
                return
            tried = self.control.copy()
            tried[members, : len(found)] = nodes.place[:, found]
            tried[members, len(found) :] = nodes.place[:, found[-1:]]
            broken = Vicinity(tried, self.costs, self.demand).worse(self.vicinity)
            if not broken:
                self.control = tried if self._as_good(tried, cell) else self.control
                return
            known = len(forbidden), len(stops), sum(stops.values()), bounds.allowed.sum()
            for part in broken:
                if part.name == TURN:
                    self._turn(tried, part, found, stops)
                elif part.name == SEPARATION and len(members) == 1:
                    self._keep_away(part, members[0], nodes.place[0], bounds.allowed)
                else:
                    self._cut(part, found, nodes, forbidden, stops)
            if known == (len(forbidden), len(stops), sum(stops.values()), bounds.allowed.sum()):
                return

    def _may_stay(self, members: list[int], start: Array) -> bool:
        """Return true if agents without team conditions may stay at their starts, (agents, 1, dim), metres."""
        return not _of_team(self.demand) and bool(self._allowed(members, start, 0.0)[0].all())

    def _as_good(self, tried: Array, cell: float) -> bool:
        """Return true if each goal is satisfied as well as before by control points (agents, points, dim), metres."""
        states = self.costs.splines.states(tried)
        return all(need.demand.worst(*states) >= self._least(need, cell) - ROUNDING for need in self.needs)

    def _least(self, need: _Need, cell: float) -> float:
        """Required robustness of a goal, metres: its current robustness, or less by half a ``cell`` if it exceeds
        ``room``."""
        return max(min(need.worst, self.room), need.worst - cell)

    def _turn(self, tried: Array, part: Rows, found: Indices, stops: dict[int, int]) -> None:
        """Add nodes at which the path turns by more than the limit to ``stops``, with the number of steps for the turn.

        Args:
            tried: (agents, points, dim), metres.
        """
        one, other = part.arguments
        soonest = (other.first - one.first).min()  # a turn is too large for all pairs of steps around it
        for agent, early, late in zip(one.agent, one.first, other.first, strict=True):
            if late - early > soonest:
                continue
            before, after = (tried[agent, step + 1, :2] - tried[agent, step, :2] for step in (early, late))
            angle = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
            limit = turn_in_step(self.costs.mission.agents[agent].dynamics, self.costs.splines.step)
            turned = abs((angle + np.pi) % (2 * np.pi) - np.pi) / (limit * (1 - self.costs.spare.limits))
            node = int(found[early + 1])
            stops[node] = max(stops.get(node, 0), int(np.ceil(turned)) - 1)

    def _keep_away(self, part: Rows, agent: int, nodes: Array, allowed: Flags) -> None:
        """Restrict the allowed nodes, (nodes, dim), metres, to larger distances from agents in conflict between two
        steps."""
        position, _ = self.costs.splines.states(self.control)
        one, other = part.arguments[:2]
        for first, second, step, short in zip(one.agent, other.agent, one.first, part.value, strict=True):
            met = second if first == agent else first
            here, there = position[met, step], position[met, step + 1]
            square = max(float((there - here) @ (there - here)), ROUNDING)
            share = np.clip((nodes - here) @ (there - here) / square, 0.0, 1.0)[:, None]
            away = np.linalg.norm((nodes - here - share * (there - here)) * self.metric[agent, met], axis=1)
            allowed[:, step : step + 2] &= away >= self.apart[agent, met] + min(short, self.room)

    def _cut(
        self, part: Rows, found: Indices, nodes: Nodes, forbidden: set[tuple[int, int]], stops: dict[int, int]
    ) -> None:
        """Add forbidden steps after an obstacle conflict: nodes at corners that a step cuts must be visited."""
        first = {int(step) for each in part.arguments for step in each.first}
        last = len(found) - 1
        if last > self.costs.splines.steps:  # three control points determine a step
            first |= {step + 1 for step in first}
        for here, there in sorted({(int(found[each]), int(found[each + 1])) for each in first if each < last}):
            corner = nodes.corner(here, there) if part.name == OBSTACLES else None
            if corner is not None:
                stops.setdefault(corner, 0)
            elif here != there:
                forbidden.add((here, there))

    def _allowed(self, members: list[int], nodes: Array, cell: float) -> Flags:
        """Nodes allowed at each step and speed of ``SPEEDS`` so that each goal is satisfied as well as before.

        Args:
            nodes: (agents, nodes, dim), metres.

        Returns:
            (speeds, steps + 1, nodes), boolean.
        """
        mission = self.costs.mission
        position, velocity = self.costs.splines.states(self.control)
        there, going = (np.repeat(each[:, None], nodes.shape[1], axis=1) for each in (position, velocity))
        there[members] = nodes[:, :, None]
        top = np.array([mission.agents[each].dynamics.top_speed for each in members])[:, None, None, None]
        allowed = np.ones((len(SPEEDS), mission.steps + 1, nodes.shape[1]), dtype=np.bool_)
        for number, share in enumerate(SPEEDS):
            going[members] = 0.0
            going[members, ..., :1] = share * top
            for need in self.needs:
                least = self._least(need, cell) - ROUNDING
                for asked in need.asked:
                    if not asked.about[members].any():
                        continue
                    if asked.reads_speed:
                        allowed[number, asked.steps] &= (asked.worst(mission, there, going) >= least).T
                    elif number == 0:
                        allowed[:, asked.steps] &= (asked.worst(mission, there, going) >= least).T
        others = np.setdiff1d(np.arange(len(position)), members)
        for number, agent in enumerate(members):
            for other in others:
                away = np.linalg.norm((nodes[number] - position[other][:, None]) * self.metric[agent, other], axis=2)
                allowed &= away >= self.apart[agent, other] - ROUNDING
            finish = mission.agents[agent].finish
            if finish is not None and finish.region is not None:
                allowed[:, -1] &= signed_distance(np, finish.shape, nodes[number]) <= 0
        return allowed


def _apart(costs: Costs, position: Array) -> tuple[Array, Array]:
    """Required distances of agents, (agents, agents), metres, and factors on the axes, (agents, agents, dim).

    The required distance is the current least distance over the positions, (agents, steps + 1, dim), or a sufficient
    margin if smaller.
    """
    mission, spacing = costs.mission, SpacingTable.of(costs.mission)
    pairs = np.arange(len(position))[:, None], np.arange(len(position))
    factors = spacing.metric(*pairs)
    metric = np.ones((len(position), len(position), position.shape[2])) if factors is None else factors
    nearest = np.full(metric.shape[:2], np.inf)
    for places in position.transpose(1, 0, 2):
        nearest = np.minimum(nearest, np.linalg.norm((places[:, None] - places) * metric, axis=2))
    return np.asarray(np.minimum(nearest, spacing.between(*pairs) + with_room(mission).bodies)), metric
