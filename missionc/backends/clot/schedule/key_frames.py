"""Key frames: the positions of all agents at the steps that matter, one configuration at a time.

    in   Schedule
    out  the positions of all agents at some of the steps

A configuration has all that must hold at its step: regions, formations, links, bodies apart.
It is found by moving the one before it as little as the holds allow, from several first
guesses: the team moved as it is, turned, or packed into slots of the region.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from missionc.backends.clot.cost_weights import Weights, spare
from missionc.backends.clot.optimise.control_points import Splines
from missionc.backends.clot.optimise.goal_terms import Demand
from missionc.backends.clot.optimise.levenberg_marquardt import Polished, polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.schedule.geodesics import Geodesics, along
from missionc.backends.clot.schedule.schedule import Schedule, Scheduler
from missionc.base.trace import Array, Flags
from missionc.ir import Anywhere, Exactly, Inside, Mission, Proximity, Region
from missionc.kernel.nodes import At, Atom
from missionc.world.sampling import points_in
from missionc.world.signed_distance import signed_distance

ITERATIONS = 40
"""Iterations of one guess at one configuration."""

JITTER = 0.02
"""Metres by which a guess is shaken: what is exactly straight, or exactly on top of another, has no way out."""

PITCHES = 0.95, 0.75
"""How far apart relays are put, of what their graph bridges."""


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """Args:
    position: (agents, dim), metres.
    shortfall: metres by which the worst margin fails at this step; at most 0 where all hold.
    """

    step: int
    position: Array
    shortfall: float
    worst: str


def key_frames(
    mission: Mission,
    schedule: Schedule,
    scheduler: Scheduler,
    geodesics: Geodesics,
    generator: np.random.Generator,
    go_on: Callable[[], bool] = lambda: True,
) -> tuple[KeyFrame, ...]:
    """The key frames of a schedule, in order; the first and the last step are among them.

    Args:
        go_on: once it says no, first guesses are taken as they are.
    """
    return _KeyFrames(mission, schedule, scheduler, geodesics, generator, go_on).all()


class _KeyFrames:
    def __init__(
        self,
        mission: Mission,
        schedule: Schedule,
        scheduler: Scheduler,
        geodesics: Geodesics,
        generator: np.random.Generator,
        go_on: Callable[[], bool],
    ) -> None:
        self.mission, self.schedule, self.scheduler, self.generator = mission, schedule, scheduler, generator
        self.steps = mission.steps
        self.geodesics, self.go_on = geodesics, go_on

    def all(self) -> tuple[KeyFrame, ...]:
        located = sorted({0, *(each.step for each in self.schedule.appointments)})
        others = {hold.low for hold in self.schedule.holds if hold.timeless} | {self.steps}
        if any(agent.finish is not None for agent in self.mission.agents):
            located = sorted({*located, self.steps})
        frames: dict[int, KeyFrame] = {}
        before: Array | None = None
        for step in located:
            frames[step] = self._frame(step, self._guesses(step, before))
            before = frames[step].position
        for step in sorted(others - set(located)):
            earlier = max(each for each in frames if each < step)
            later = [each for each in frames if each > step]
            guess = frames[earlier].position
            if later:
                share = (step - earlier) / (min(later) - earlier)
                guess = guess * (1 - share) + frames[min(later)].position * share
            frames[step] = self._frame(step, iter((guess,)))
        return tuple(frames[step] for step in sorted(frames))

    def _frame(self, step: int, guesses: Iterator[Array]) -> KeyFrame:
        """The first guess that can be made right, or the one that comes nearest."""
        demand = self._demand(step)
        pinned = self._pinned(step)
        costs = Costs(self.mission, self._still(pinned), Weights(), spare(self.mission), step)
        best: Polished | None = None
        for polished in self._tries(step, guesses, costs, demand):
            if best is None or polished.shortfall < best.shortfall:
                best = polished
            if best.shortfall <= 0 or not self.go_on():
                break
        assert best is not None
        return KeyFrame(step, best.control[:, 0], best.shortfall, best.worst)

    def _tries(self, step: int, guesses: Iterator[Array], costs: Costs, demand: Demand) -> Iterator[Polished]:
        """What becomes of each guess; then of it, and of what it became, with relays along the links asked for."""
        for guess in guesses:
            polished = self._polished(step, guess, costs, demand)
            yield polished
            for each in (guess, polished.control[:, 0]):
                for relayed in self._relayed(step, each, demand):
                    yield self._polished(step, relayed, costs, demand)

    def _polished(self, step: int, guess: Array, costs: Costs, demand: Demand) -> Polished:
        shaken = guess + JITTER * self.generator.uniform(-1, 1, guess.shape)
        for agent, point in self._exact(step).items():
            shaken[agent] = point
        control = np.repeat(shaken[:, None, :], costs.splines.points, axis=1)
        return polish(control, costs, demand, ITERATIONS, self.go_on)

    # --------------------------------------------------------- what is asked

    def _demand(self, step: int) -> Demand:
        """Everything that holds at a step, and the places of starts and finishes that are regions."""
        here = [hold for hold in self.schedule.holds if hold.timeless and hold.low <= step <= hold.high]
        roots = [At(hold.agent, hold.node) for hold in here]
        for agent in self.mission.agents:
            place = agent.start if step == 0 else agent.finish if step == self.steps else None
            if isinstance(place, Anywhere):
                roots.append(At(agent.index, Atom(Inside(place.region, False))))
        choices = {
            (each.node, each.agent, 0): each.part for each in self.schedule.decisions if each.low <= step <= each.high
        }
        return Demand.of(self.mission, tuple(roots), choices, 0)

    def _exact(self, step: int) -> dict[int, Array]:
        points = {}
        for agent in self.mission.agents:
            place = agent.start if step == 0 else agent.finish if step == self.steps else None
            if isinstance(place, Exactly):
                points[agent.index] = np.array(place.point)
        return points

    def _pinned(self, step: int) -> Flags:
        pinned = np.zeros(len(self.mission.agents), dtype=np.bool_)
        pinned[list(self._exact(step))] = True
        return pinned

    def _still(self, pinned: Flags) -> Splines:
        fixed = np.ones((len(pinned), 3), dtype=np.bool_)
        fixed[:, 0] = pinned
        return Splines(0, float(self.mission.step), np.zeros(len(pinned), dtype=np.bool_), fixed)

    # --------------------------------------------------------------- guesses

    def _guesses(self, step: int, before: Array | None) -> Iterator[Array]:
        places = self._places(step)
        if before is None:
            before = np.array([self.scheduler.starts[agent.index] for agent in self.mission.agents])
            if not places:
                yield before
                return
            yield self._packed(before, places)
            yield self._packed(before, places, 0.7)
            yield self._packed(before, places, 0.5)
            return
        if not places:
            yield before
            return
        yield self._moved(before, places, 0.0)
        yield from self._trailing(step, before, places)
        for turn in (90.0, 45.0, 135.0):
            yield self._moved(before, places, turn)
        for pitch in (1.0, 0.7, 0.5):
            yield self._packed(before, places, pitch)

    def _places(self, step: int) -> dict[Region, list[int]]:
        """The regions that agents are asked to be in at a step, by what is decided."""
        places: dict[Region, list[int]] = {}
        regions: dict[int, Region] = {}
        for appointment in self.schedule.appointments:
            if appointment.step <= step <= appointment.step + appointment.visit.lasts:
                regions.update(dict(appointment.visit.regions))
        for agent in self.mission.agents:
            place = agent.start if step == 0 else agent.finish if step == self.steps else None
            if isinstance(place, Anywhere):
                regions[agent.index] = place.region
        for agent_index, region in regions.items():
            places.setdefault(region, []).append(agent_index)
        return places

    def _moved(self, before: Array, places: dict[Region, list[int]], turn: float) -> Array:
        """Everybody as before, the agents of each region carried there together; the others go along by half."""
        guess = before.copy()
        angle = np.deg2rad(turn)
        shifts = []
        carried: set[int] = set()
        for region, agents in places.items():
            middle = before[agents].mean(axis=0)
            around = before[agents] - middle
            if turn:
                x, y = around[:, 0].copy(), around[:, 1].copy()
                around[:, 0], around[:, 1] = (
                    np.cos(angle) * x - np.sin(angle) * y,
                    np.sin(angle) * x + np.cos(angle) * y,
                )
            target = self._toward(region, middle, float(np.linalg.norm(around, axis=1).max(initial=0.0)))
            guess[agents] = target + around
            shifts.append(target - middle)
            carried |= set(agents)
        rest = [agent for agent in range(len(guess)) if agent not in carried]
        if rest and len(carried) > 1:
            guess[rest] += np.mean(shifts, axis=0)
        return guess

    def _trailing(self, step: int, before: Array, places: dict[Region, list[int]]) -> Iterator[Array]:
        """Where a place is for one agent only: the others behind it on the way there, as far as they are tied to it."""
        ties, spacing = self._ties(step)
        for region, agents in places.items():
            if len(agents) != 1 or not ties[agents[0]].any():
                continue
            first = agents[0]
            depth = _depths(ties, first)
            team = np.flatnonzero(depth >= 0)
            target = self._toward(region, before[first], self.mission.agents[first].radius)
            radius = self.mission.agents[first].radius + self.mission.clearance
            way = self.geodesics.way(target, before[team].mean(axis=0), radius + 0.3, radius)
            if way is None:
                continue
            guess = before.copy()
            for layer in range(int(depth.max()) + 1):
                abreast = np.flatnonzero(depth == layer)
                here, ahead = _on(way, layer * spacing), _on(way, layer * spacing + 0.1)
                heading = (ahead - here) / max(float(np.linalg.norm(ahead - here)), 1e-9)
                aside = np.zeros_like(heading)
                aside[0], aside[1] = -heading[1], heading[0]
                width = np.arange(len(abreast)) - (len(abreast) - 1) / 2
                guess[abreast] = here + width[:, None] * aside * min(spacing, 0.5)
            yield guess

    def _relayed(self, step: int, guess: Array, demand: Demand) -> Iterator[Array]:
        """Where links are asked for that are too long: agents whom no place is asked of, evenly along them."""
        active = demand.active(guess[:, None], np.zeros_like(guess)[:, None])
        busy = self._busy(step)
        for pitch in PITCHES:
            relayed = guess.copy()
            for graph, lists in active.joined.items():
                if not isinstance(graph, Proximity):
                    continue
                ends = np.unique(np.concatenate(lists)[:, :2], axis=0)
                lacking = (np.linalg.norm(np.diff(guess[ends], axis=1)[:, 0], axis=-1) / (pitch * graph.radius)).astype(
                    int
                )
                free = [agent for agent in graph.agents if agent not in busy.union(ends[lacking > 0].ravel().tolist())]
                for (one, other), count in zip(ends.tolist(), lacking.tolist(), strict=True):
                    slots = min(count, len(free))
                    share = np.arange(1, slots + 1)[:, None] / (slots + 1)
                    between = guess[one] + share * (guess[other] - guess[one])
                    slot, chosen = linear_sum_assignment(cdist(between, guess[free], "sqeuclidean"))
                    taken = [free[number] for number in chosen]
                    relayed[taken] = between[slot]
                    free = [agent for agent in free if agent not in taken]
            if not np.array_equal(relayed, guess):
                yield relayed

    def _busy(self, step: int) -> set[int]:
        """Agents who are asked to be somewhere at a step, or are where they must be."""
        places = {
            hold.agent
            for hold in self.schedule.holds
            if hold.low <= step <= hold.high and isinstance(hold.node, Atom) and hold.node.predicate.region
        }
        return places | {agent for agents in self._places(step).values() for agent in agents} | set(self._exact(step))

    def _ties(self, step: int) -> tuple[Flags, float]:
        """Who is tied to whom by what holds at a step, (agents, agents), and how far apart ties keep them, metres."""
        count = len(self.mission.agents)
        ties = np.zeros((count, count), dtype=np.bool_)
        spacing: list[float] = []
        for hold in self.schedule.holds:
            node = hold.node
            if not (isinstance(node, Atom) and hold.low <= step <= hold.high):
                continue
            graph = node.predicate.restricted
            for edge in node.predicate.formation.edges if node.predicate.formation else ():
                ties[edge.first, edge.second] = ties[edge.second, edge.first] = True
                spacing.append(float(np.linalg.norm(edge.target)))
            if isinstance(graph, Proximity) and not spacing:
                ties[np.ix_(graph.agents, graph.agents)] = True
                spacing.append(0.8 * graph.radius)
        return ties, min(spacing, default=0.0)

    def _toward(self, region: Region, middle: Array, extent: float) -> Array:
        """Where in a region the middle of a team goes: no further in than it takes to have room around it."""
        centre = self.scheduler.centre(region)
        deepest = -float(signed_distance(np, region.shape, centre))
        wanted = min(extent + 0.1, deepest * 0.95)
        low, high = 0.0, 1.0
        for _ in range(20):
            half = (low + high) / 2
            inside = -float(signed_distance(np, region.shape, middle + half * (centre - middle)))
            low, high = (low, half) if inside >= wanted else (half, high)
        target: Array = middle + high * (centre - middle)
        return target

    def _packed(self, before: Array, places: dict[Region, list[int]], pitch: float = 1.0) -> Array:
        """The agents of each region in slots around its middle, each in the one that takes least moving in all."""
        guess = before.copy()
        for region, agents in places.items():
            slots = self._slots(region, agents, pitch)
            middle = before[agents].mean(axis=0)
            around = before[agents] - middle
            _, chosen = linear_sum_assignment(cdist(around, slots - slots.mean(axis=0), "sqeuclidean"))
            guess[agents] = slots[chosen]
        return guess

    def _slots(self, region: Region, agents: list[int], pitch: float) -> Array:
        """As many places in a region as agents, spread on a grid, nearest to its middle first."""
        widest = max(self.mission.agents[agent].radius for agent in agents)
        apart = 2 * widest + self.mission.separation + 0.3 * pitch
        centre = self.scheduler.centre(region)
        count = int(np.ceil(np.sqrt(len(agents)))) + 4
        line = (np.arange(2 * count + 1) - count) * apart
        grids = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.tile(centre, (len(grids), 1))
        points[:, :2] += grids
        inside = -np.asarray(signed_distance(np, region.shape, points)) >= widest
        near = points[inside][np.argsort(np.linalg.norm(points[inside] - centre, axis=1), kind="stable")]
        if len(near) >= len(agents):
            chosen: Array = near[: len(agents)]
            return chosen
        spread, _ = points_in(region.shape, self.mission.world, 4 * len(agents), np.random.default_rng(0))
        padded: Array = np.concatenate([near, spread, np.tile(centre, (len(agents), 1))])[: len(agents)]
        return padded


def _depths(ties: Flags, first: int) -> Array:
    """By how many ties each agent is away from the first, (agents,); -1 where nothing ties it there."""
    depth = np.full(len(ties), -1)
    depth[first] = 0
    layer = np.array([first])
    while layer.size:
        ahead = np.flatnonzero(ties[layer].any(axis=0) & (depth < 0))
        depth[ahead] = depth[layer[0]] + 1
        layer = ahead
    return depth


def _on(way: Array, distance: float) -> Array:
    """The point so many metres along a way; straight on where it ends."""
    lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
    total = float(lengths.sum())
    if distance <= total and total > 0:
        point: Array = along(way, np.array([distance / total]))[0]
        return point
    last = (way[-1] - way[-2]) / max(float(np.linalg.norm(way[-1] - way[-2])), 1e-9)
    beyond: Array = way[-1] + last * (distance - total)
    return beyond
