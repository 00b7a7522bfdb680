"""Joint waypoints (key frames): one configuration of the whole team for each important step.

    in   Schedule
    out  positions of all agents at some of the steps

A configuration satisfies all conditions of its step: regions, formations, links, separation. It is the smallest change
of the previous configuration that the conditions allow, from several first guesses: the team translated, rotated, or
packed into slots of the region. A team that changes into a formation is placed where all of it has clearance and the
longest path is short. A continuing file follows its leader.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from missionc.backends.clot.cost_weights import spare
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import Splines
from missionc.backends.clot.optimise.levenberg_marquardt import Polished, polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.schedule.gather_team import tree_of
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.initial_configurations import FirstGuesses, Guess
from missionc.backends.clot.schedule.presence import agents_of
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import Hold
from missionc.backends.clot.schedule.visits import NO_TOURS, Appointment, KeyFrame, Routes, Schedule, Visit
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.polylines import at_shares, length, split
from missionc.ir import Graph, Inside, Mission, Predicate
from missionc.ir.couplings import range_of
from missionc.ir.kernel.nodes import At, Atom

PITCHES = 0.95, 0.75
"""Distances of relays, relative to the range of their graph."""


def joint_waypoints(
    mission: Mission,
    schedule: Schedule,
    scheduler: Scheduler,
    geodesics: Geodesics,
    generator: np.random.Generator,
    go_on: Callable[[], bool] = lambda: True,
    toured: Mapping[int, Array] = NO_TOURS,
) -> tuple[KeyFrame, ...]:
    """Joint waypoints of a schedule, in order, including the first and the last step.

    Args:
        go_on: function that returns true while time is left; without time, first guesses are not corrected.
        toured: positions, (steps + 1, dim), metres, of agents on separate tours.
    """
    kept = replace(schedule, holds=tuple(_kept_to_the_event(schedule)))
    return _KeyFrames(mission, kept, scheduler, geodesics, generator, go_on, toured).all()


def _kept_to_the_event(schedule: Schedule) -> Iterator[Hold]:
    """Yield the holds of a schedule, with formations before an event extended to it, since agents are still in them one
    step before.

    The exception is an event with another formation of the same agents.
    """
    for hold in schedule.holds:
        ended = [each.visit for each in schedule.appointments if each.step == hold.high + 1]
        if isinstance(hold.node, Atom) and any(_goes_on(hold.node.predicate, visit) for visit in ended):
            yield replace(hold, high=hold.high + 1)
        else:
            yield hold


def _goes_on(formation: Predicate, visit: Visit) -> bool:
    return formation in visit.kept and all(formation.others.isdisjoint(shape.others) for shape in visit.shapes)


class _KeyFrames(FirstGuesses):
    def all(self) -> tuple[KeyFrame, ...]:
        located = sorted(
            {0, *(each.step for each in self.schedule.appointments if self._matters(each)), *self._released()}
        )
        others = {hold.low for hold in self._holds() if hold.timeless} | {self.steps}
        if any(agent.finish is not None for agent in self.mission.agents):
            located = sorted({*located, self.steps})
        frames: dict[int, KeyFrame] = {}
        before: KeyFrame | None = None
        for step in located:
            frames[step] = before = self._frame(step, self._guesses(step, before), before)
        for step in sorted(others - set(located)):
            earlier = max(each for each in frames if each < step)
            later = min((each for each in frames if each > step), default=None)
            guess, behind, ahead = frames[earlier].position, Routes(), Routes()
            if later is not None:
                share = (step - earlier) / (later - earlier)
                guess = guess * (1 - share) + frames[later].position * share
                for agent, route in frames[later].routes.items():
                    behind[agent], ahead[agent] = split(route, share)
                    guess[agent] = behind[agent][-1]
                frames[later] = replace(frames[later], routes=ahead)
            frames[step] = self._frame(step, iter(((guess, behind),)), frames[earlier])
        return tuple(frames[step] for step in sorted(frames))

    def _matters(self, appointment: Appointment) -> bool:
        """Return true if the appointment concerns agents other than those on tours."""
        visit = appointment.visit
        return (
            not visit.agents
            or not visit.agents <= self.toured.keys()
            or not all(map(self._is_toured, visit.event.before))
        )

    def _is_toured(self, hold: Hold) -> bool:
        """Return true if the positions of agents on tours decide the hold."""
        whom = agents_of(hold.agent, hold.node) if self.toured else None
        return whom is not None and whom <= self.toured.keys()

    def _holds(self) -> list[Hold]:
        """Holds about agents that are not on tours."""
        return [hold for hold in self.schedule.holds if not self._is_toured(hold)]

    def _frame(self, step: int, guesses: Iterator[Guess], before: KeyFrame | None) -> KeyFrame:
        """Joint waypoint from the first guess that can be corrected, or the best result if none can."""
        demand = self._demand(step)
        pinned = self._pinned(step)
        costs = Costs(self.mission, self._still(pinned), clot_settings(self.mission).weights, spare(self.mission), step)
        best: tuple[Polished, Routes] | None = None
        for polished, routes in self._tries(step, guesses, before, costs, demand):
            if best is None or polished.shortfall < best[0].shortfall:
                best = polished, routes
            if best[0].shortfall <= 0 or not self.go_on():
                break
        assert best is not None
        polished, routes = best
        return KeyFrame(step, polished.control[:, 0], polished.shortfall, polished.worst, routes)

    def _tries(
        self, step: int, guesses: Iterator[Guess], before: KeyFrame | None, costs: Costs, demand: Demand
    ) -> Iterator[tuple[Polished, Routes]]:
        """Yield the optimised result of each guess, then the optimised results with relays along the required links.

        Relays on bent paths come first, since the ends of links across obstacles may be far apart.
        """

        def relayed(guesses: Iterator[Array]) -> Iterator[tuple[Polished, Routes]]:
            for each in guesses:
                polished = self._polished(step, each, costs, demand)
                yield polished, self._spreading(step, before, polished.control[:, 0])

        for guess, routes in guesses:
            yield from relayed(self._relayed(guess, step, demand, round_corners=True))
            polished = self._polished(step, guess, costs, demand)
            yield polished, routes
            for each in (guess, polished.control[:, 0]):
                yield from relayed(self._relayed(each, step, demand, round_corners=False))

    def _polished(self, step: int, guess: Array, costs: Costs, demand: Demand) -> Polished:
        settings = clot_settings(costs.mission).guess
        shaken = guess + settings.jitter * self.generator.uniform(-1, 1, guess.shape)
        for agent, point in self._exact(step).items():
            shaken[agent] = point
        control = np.repeat(shaken[:, None, :], costs.splines.points, axis=1)
        return polish(control, costs, demand, settings.iterations, self.go_on)

    # --------------------------------------------------------- conditions

    def _demand(self, step: int) -> Demand:
        """Conditions at a step, including the start and finish regions."""
        here = [hold for hold in self._holds() if hold.timeless and hold.low <= step <= hold.high]
        roots = [At(hold.agent, hold.node) for hold in here]
        for agent, place in self.mission.ends_at(step):
            if place.region is not None:
                roots.append(At(agent.index, Atom(Inside(place.region, False))))
        choices = {
            (each.node, each.agent, 0): each.part for each in self.schedule.decisions if each.low <= step <= each.high
        }
        return Demand.of(self.mission, tuple(roots), choices, 0)

    def _still(self, pinned: Flags) -> Splines:
        fixed = np.ones((len(pinned), 3), dtype=np.bool_)
        fixed[:, 0] = pinned
        return Splines(0, float(self.mission.step), np.zeros(len(pinned), dtype=np.bool_), fixed)

    # --------------------------------------------------------------- guesses

    def _relayed(self, guess: Array, step: int, demand: Demand, *, round_corners: bool) -> Iterator[Array]:
        """Yield positions with agents without a goal spread evenly along links that are too long: (agents, dim),
        metres.

        Args:
            round_corners: True to follow paths around static obstacles if they bend; False for straight lines.
        """
        busy = self._busy(step)
        links = [
            (graph, ends, self._ways(graph, ends, guess, round_corners=round_corners))
            for graph, ends in self._links(guess, step, demand)
        ]
        if round_corners and not any(len(way) > 2 for *_, ways in links for way in ways):
            return
        for pitch in PITCHES:
            relayed = guess.copy()
            for graph, ends, ways in links:
                far, reach = _stretched(graph, ends, guess, PITCHES[0] if round_corners else pitch)
                lacking = [
                    int(length(way) / (pitch * most)) if too_far and most > 0 else 0
                    for way, too_far, most in zip(ways, far, reach, strict=True)
                ]
                free = [agent for agent in graph.agents if agent not in busy.union(ends[far].ravel().tolist())]
                for way, count in zip(ways, lacking, strict=True):
                    slots = min(count, len(free))
                    between = at_shares(way, np.arange(1, slots + 1) / (slots + 1))
                    slot, chosen = linear_sum_assignment(cdist(between, guess[free], "sqeuclidean"))
                    taken = [free[number] for number in chosen]
                    relayed[taken] = between[slot]
                    free = [agent for agent in free if agent not in taken]
            if not np.array_equal(relayed, guess):
                yield relayed

    def _ways(self, graph: Graph, ends: Indices, guess: Array, *, round_corners: bool) -> list[Array]:
        """Path along each link, (corners, dim), metres: straight, or for long links around static obstacles."""
        far, _ = _stretched(graph, ends, guess, PITCHES[0])
        return [
            self._way(graph.agents, *guess[pair]) if round_corners and too_far else guess[pair]
            for pair, too_far in zip(ends, far, strict=True)
        ]

    def _links(self, guess: Array, step: int, demand: Demand) -> Iterator[tuple[Graph, Indices]]:
        """Yield the required links of each graph, (links, 2), agents; for a connected graph, the links of a spanning
        tree.

        Args:
            guess: (agents, dim), metres.
        """
        active = demand.active(guess[:, None], np.zeros_like(guess)[:, None])
        for graph, lists in active.joined.items():
            if graph.by_distance:
                yield graph, np.unique(np.concatenate(lists)[:, :2], axis=0)
        for shape in self._shapes(step, step):
            whole = shape.restricted
            if whole is not None and whole.by_distance and len(whole.agents) > 1:
                yield whole, tree_of(whole, guess)

    def _way(self, agents: tuple[int, ...], start: Array, end: Array) -> Array:
        """Path around static obstacles for the widest of the agents, (corners, dim), metres; straight if no such path
        exists."""
        room = max(self.mission.agents[agent].radius for agent in agents) + self.mission.clearance
        way = self.geodesics.way(start, end, room + clot_settings(self.mission).guess.clearance, room)
        return np.stack([start, end]) if way is None else way

    def _spreading(self, step: int, before: KeyFrame | None, position: Array) -> Routes:
        """Routes from the previous joint waypoint of agents that a graph links, (corners, dim), metres."""
        linked = [shape.restricted.agents for shape in self._shapes(step, step) if shape.restricted is not None]
        if before is None:
            return {}
        return {
            agent: self._way((agent,), before.position[agent], position[agent])
            for agent in sorted({agent for agents in linked for agent in agents})
        }


def _stretched(graph: Graph, ends: Indices, position: Array, share: float) -> tuple[Flags, Array]:
    """Links, (links, 2), longer than a fraction of their graph's range: flags, and the range of each link, metres."""
    reach = np.array([range_of(graph, *pair) for pair in ends.tolist()])
    return np.linalg.norm(np.diff(position[ends], axis=1)[:, 0], axis=-1) > share * reach, reach
