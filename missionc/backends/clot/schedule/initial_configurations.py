"""Initial configurations of a team at a step: the previous configuration moved, packed into a region, in formation, or
in file."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import product
from typing import TypeAlias

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from missionc.backends.clot.schedule.follow_leader import File, FormationSlot, files, led
from missionc.backends.clot.schedule.gather_team import can_be_gathered, depths_of, gather_team, teams_of, turned_by
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.visits import KeyFrame, Routes, Schedule
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array, Flags
from missionc.geometry.polylines import at_length, at_shares
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission, Predicate, Region
from missionc.ir.couplings import all_ranges
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom

Guess: TypeAlias = tuple[Array, Routes]
"""Positions of all agents, (agents, dim), metres, and their routes."""


class FirstGuesses:
    """Generator of first guesses for the configurations of a schedule."""

    def __init__(
        self,
        mission: Mission,
        schedule: Schedule,
        scheduler: Scheduler,
        geodesics: Geodesics,
        generator: np.random.Generator,
        go_on: Callable[[], bool],
        toured: Mapping[int, Array],
    ) -> None:
        self.mission, self.schedule, self.scheduler, self.generator = mission, schedule, scheduler, generator
        self.steps, self.places = mission.steps, scheduler.places
        self.geodesics, self.go_on, self.toured = geodesics, go_on, toured

    def _guesses(self, step: int, before: KeyFrame | None) -> Iterator[Guess]:
        places = self._places(step)
        if before is None:
            position = np.array([self.scheduler.starts[agent.index] for agent in self.mission.agents])
            pitches = (1.0, 0.7, 0.5) if places else ()
            yield from ((self._packed(position, places, pitch), {}) for pitch in pitches)
            if not places:
                yield position, {}
            return
        position, following = self._under_way(before, step), self._following(before, step, places)
        if following is not None:
            yield following
        formed = gather_team(self._shapes(step, step), position)
        if formed is not position:
            yield self._formed(step, position, formed, places), {}
        if not places:
            yield position, {}
            return
        yield self._moved(step, position, places, 0.0), {}
        yield from ((guess, {}) for guess in self._trailing(step, position, places))
        for turn in (90.0, 45.0, 135.0):
            yield self._moved(step, position, places, turn), {}
        for pitch in (1.0, 0.7, 0.5):
            yield self._packed(position, places, pitch), {}

    def _under_way(self, before: KeyFrame, step: int) -> Array:
        """Positions of all agents, (agents, dim), metres: previous or meeting positions; idle agents are on the path to
        their next goal.

        Agents coupled by a formation or links until then move together if none of them has a goal.
        """
        position = before.position.copy()
        met = self._met(step)
        busy = self._busy(step) | met.keys()
        tied = {agent for shape in self._shapes(before.step + 1, step) for agent in shape.others}
        free = set(range(len(position))) - tied - busy
        teams = [team for team in teams_of(self._ties(step)[0]) if len(team) > 1 and busy.isdisjoint(team)]
        if step in self._released():
            teams = []
        for agent, point in met.items():
            position[agent] = point
        for appointment in sorted(self.schedule.appointments, key=lambda each: each.step):
            share = (step - before.step) / max(1, appointment.step - before.step)
            for agent, region in appointment.visit.regions if appointment.step > step else ():
                going = [agent] if agent in free else next((team for team in teams if agent in team), None)
                if going is None or (agent not in free and going not in teams_of(self._ties(appointment.step)[0])):
                    continue
                free.discard(agent)
                teams = [team for team in teams if team is not going]
                radius = max(self.mission.agents[each].radius for each in going)
                room = radius + self.mission.clearance
                goal = self._nearest(region, position[agent], radius, room)
                wide = room + clot_settings(self.mission).guess.clearance
                way = self.geodesics.way(position[agent], goal, wide, room)
                if way is not None and np.asarray(signed_distance(np, region.shape, position[agent])) > 0:
                    position[going] += at_shares(way, np.array([share]))[0] - position[agent]
        return position

    def _released(self) -> set[int]:
        """Steps up to which teams stay in a formation, or linked, for a common event."""
        return {
            min(each.step + each.visit.lasts, self.steps)
            for each in self.schedule.appointments
            if each.visit.shapes and each.visit.lasts
        }

    def _met(self, step: int) -> dict[int, Array]:
        """Scheduled meeting positions at a step, (dim,), metres, by agent."""
        return {
            place.agent: place.point
            for appointment in self.schedule.appointments
            if appointment.step <= step <= appointment.step + appointment.visit.lasts
            for place in appointment.places
            if any(place.agent in meeting.agents for meeting in appointment.visit.come.meetings)
        }

    def _shapes(self, low: int, high: int) -> Iterator[Predicate]:
        """Yield the formation and graph predicates that are required at some step from ``low`` to ``high``."""
        for hold in self.schedule.holds:
            if (
                hold.low <= high
                and hold.high >= low
                and isinstance(hold.node, Atom)
                and can_be_gathered(hold.node.predicate)
            ):
                yield hold.node.predicate

    def _following(self, before: KeyFrame, step: int, places: dict[Region, list[int]]) -> Guess | None:
        """Positions in which single files of agents, which persist since the previous joint waypoint, have followed
        their leaders; None if no file moves."""
        routes: dict[int, Array] = {}
        for file in files(self.schedule, before.step, step):
            routes.update(self._led(file, before.position, places) or {})
        if not routes:
            return None
        guess = before.position.copy()
        for agent, route in routes.items():
            guess[agent] = route[-1]
        return guess, routes

    def _led(self, file: File, position: Array, places: dict[Region, list[int]]) -> Routes | None:
        """Routes of the agents of a single file, (corners, dim), metres, to targets of some of them; None without a
        target."""
        radius = max(self.mission.agents[agent].radius for agent in file.agents)
        room = radius + self.mission.clearance + clot_settings(self.mission).guess.clearance
        found: Routes | None = None
        for region, agents in places.items():
            asked = [agent for agent in file.agents if agent in agents]
            if not asked or (np.asarray(signed_distance(np, region.shape, position[asked])) <= 0).all():
                continue
            if found is not None:  # in two places at once
                return None
            found = led(file, position, asked, self._place(region, radius, room), self.geodesics, room)
            if found is None:
                return None
        return found

    def _place(self, region: Region, depth: float, room: float) -> FormationSlot:
        """Region as the target of agents in single file, with required depth and clearance, metres."""
        cells = -np.asarray(signed_distance(np, region.shape, self.geodesics.points)).ravel()
        deep = min(depth, 0.9 * float(cells.max()))

        def holds(points: Array) -> Flags:
            return np.asarray(signed_distance(np, region.shape, points)) <= -deep

        def nearest(start: Array) -> Array:
            return self._nearest(region, start, deep, room)

        return FormationSlot(holds, nearest, cells >= deep)

    def _nearest(self, region: Region, start: Array, depth: float, room: float) -> Array:
        """Point of a region with the shortest path from ``start``, with this clearance and depth: (dim,), metres."""
        points = self.geodesics.points.reshape(-1, len(start))
        free = self.geodesics.room.ravel() >= room
        deep = -np.asarray(signed_distance(np, region.shape, points))
        inside = np.flatnonzero(free & (deep >= min(depth, float(deep.max(initial=-np.inf, where=free)))))
        if not len(inside) or float(deep[inside[0]]) < 0:
            return self.places.toward(region, start, depth)
        far = self.geodesics.lengths(start, room)[inside]
        nearest: Array = points[inside[int(far.argmin())]]
        return nearest

    def _formed(self, step: int, before: Array, formed: Array, places: dict[Region, list[int]]) -> Array:
        """Positions with each team in formation, in its regions, with clearance and short paths: (agents, dim),
        metres."""
        turns = (0.0, 90.0, 45.0, 135.0)  # degrees
        guess = before.copy()
        ties, _ = self._ties(step)
        pinned = self._pinned(step)
        turned = self._turned(step)
        kept = {agent for shape in self._shapes(step - 1, step - 1) for agent in shape.others}
        put: list[int] = []
        for team in teams_of(ties):
            figure = formed[team] - formed[team].mean(axis=0)
            if len(team) == 1 or pinned[team].any():
                guess[team] = formed[team]
                continue
            angles = turns if turned.isdisjoint(team) else turns[:1]
            figures: Iterable[Array] = (turned_by(figure, angle) for angle in angles)
            is_new = kept.isdisjoint(team)
            if is_new and turned.isdisjoint(team):
                figures = _rotations(figure, before[team], angles)
            shared = 1.0 if is_new else 1e-3
            guess[team] = self._put(team, figures, formed[team].mean(axis=0), before, guess[put], places, shared)
            put.extend(team)
        return guess

    def _put(
        self,
        team: list[int],
        figures: Iterable[Array],
        middle: Array,
        before: Array,
        others: Array,
        places: dict[Region, list[int]],
        shared: float,
    ) -> Array:
        """Placement of one of several formations with clearance and short paths: (members, dim), metres.

        Args:
            figures: positions of the members relative to the centre of their formation, (members, dim), metres.
            shared: weight of the mean path beside the longest.
        """
        settings = clot_settings(self.mission).guess
        lacking_cost = 1e3  # cost of a metre of missing clearance, in metres travelled
        cells = self.geodesics.points.reshape(-1, before.shape[1])
        middles = np.concatenate([middle[None], cells[:: max(1, len(cells) // settings.middles)]])
        radius = np.array([self.mission.agents[agent].radius for agent in team])
        needed = radius + self.mission.clearance + settings.clearance
        spacing = SpacingTable.of(self.mission).among(np.array(team))
        asked = [
            (region, [number for number, agent in enumerate(team) if agent in agents])
            for region, agents in places.items()
        ]

        def lacking_room(points: Array) -> Array:
            lacking: Array = np.maximum(needed - self.geodesics.room_at(points), 0.0).max(axis=-1)
            for region, members in asked:
                if members:
                    outside = np.asarray(signed_distance(np, region.shape, points[:, members])) + settings.clearance
                    lacking = lacking + np.maximum(outside, 0.0).max(axis=-1)
            if len(others):
                apart = np.linalg.norm(points[:, :, None] - others, axis=-1).min(axis=(1, 2))
                lacking = lacking + np.maximum(spacing - apart, 0.0)
            return lacking

        def cost(points: Array) -> Array:
            far = np.linalg.norm(points - before[team], axis=-1)
            total: Array = lacking_cost * lacking_room(points) + far.max(axis=-1) + shared * far.mean(axis=-1)
            return total

        best: tuple[float, Array] | None = None
        for around in figures:
            chosen = middles[int(cost(middles[:, None] + around).argmin())]
            pitch = self.geodesics.cell * max(1.0, len(cells) / settings.middles) ** (1 / len(middle))
            while pitch > settings.clearance and lacking_room((chosen + around)[None]).any():
                pitch /= 3
                near = chosen + pitch * np.array(list(product((-1, 0, 1), repeat=len(middle))))
                chosen = near[int(cost(near[:, None] + around).argmin())]
            # From there, back to the point with the shortest paths of its agents, as far as there is room.
            back = chosen + np.linspace(0.0, 1.0, 21)[:, None] * (middle - chosen)
            closer = back[:, None] + around
            costs = cost(closer)
            at = int(costs.argmin())
            if best is None or costs[at] < best[0]:
                best = float(costs[at]), closer[at]
        assert best is not None
        return best[1]

    def _turned(self, step: int) -> set[int]:
        """Agents of formations with a prescribed orientation."""
        return {
            agent
            for shape in self._shapes(step, step)
            if shape.formation
            for edge in shape.formation.edges
            if isinstance(edge.target, tuple)
            for agent in (edge.first, edge.second)
        }

    def _places(self, step: int) -> dict[Region, list[int]]:
        """Regions in which agents must be at a step because of the schedule's choices, with the agents."""
        places: dict[Region, list[int]] = {}
        regions: dict[int, Region] = {}
        for appointment in self.schedule.appointments:
            if appointment.step <= step <= appointment.step + appointment.visit.lasts:
                for agent_index, region in appointment.visit.regions:
                    before = regions.get(agent_index)
                    regions[agent_index] = region if before is None else self.places.both(before, region)
        for agent, place in self.mission.ends_at(step):
            if place.region is not None:
                regions[agent.index] = place.region
        for agent_index, region in regions.items():
            if agent_index in self.toured:
                continue
            places.setdefault(region, []).append(agent_index)
        return places

    def _moved(self, step: int, before: Array, places: dict[Region, list[int]], turn: float) -> Array:
        """Previous positions with the agents of each region moved into it together, and agents coupled to them carried
        along: (agents, dim), metres."""
        guess = before.copy()
        shift = np.zeros_like(before)
        carried: set[int] = set()
        for region, agents in places.items():
            middle = before[agents].mean(axis=0)
            around = before[agents] - middle
            around = turned_by(around, turn)
            target = self.places.toward(region, middle, float(np.linalg.norm(around, axis=1).max(initial=0.0)))
            guess[agents] = target + around
            shift[agents] = target - middle
            carried |= set(agents)
        for team in teams_of(self._ties(step)[0]):
            led = [agent for agent in team if agent in carried]
            if len(led) > 1:
                along = [agent for agent in team if agent not in carried]
                guess[along] += shift[led].mean(axis=0)
        return guess

    def _trailing(self, step: int, before: Array, places: dict[Region, list[int]]) -> Iterator[Array]:
        """Yield positions with one agent in its region and the agents coupled to it behind it on its path: (agents,
        dim), metres."""
        ties, spacing = self._ties(step)
        for region, agents in places.items():
            if len(agents) != 1 or not ties[agents[0]].any():
                continue
            first = agents[0]
            depth = depths_of(ties, first)
            team = np.flatnonzero(depth >= 0)
            target = self.places.toward(region, before[first], self.mission.agents[first].radius)
            radius = self.mission.agents[first].radius + self.mission.clearance
            way = self.geodesics.way(target, before[team].mean(axis=0), radius + 0.3, radius)
            if way is None:
                continue
            guess = before.copy()
            for layer in range(int(depth.max()) + 1):
                abreast = np.flatnonzero(depth == layer)
                here, ahead = at_length(way, layer * spacing), at_length(way, layer * spacing + 0.1)
                heading = (ahead - here) / max(float(np.linalg.norm(ahead - here)), 1e-9)
                aside = np.zeros_like(heading)
                aside[0], aside[1] = -heading[1], heading[0]
                width = np.arange(len(abreast)) - (len(abreast) - 1) / 2
                guess[abreast] = here + width[:, None] * aside * min(spacing, 0.5)
            yield guess

    def _busy(self, step: int) -> set[int]:
        """Agents that have a goal at a step, or must stay where they are."""
        places = {
            hold.agent
            for hold in self.schedule.holds
            if hold.low <= step <= hold.high and isinstance(hold.node, Atom) and hold.node.predicate.region
        }
        return places | {agent for agents in self._places(step).values() for agent in agents} | set(self._exact(step))

    def _ties(self, step: int) -> tuple[Flags, float]:
        """Pairs of agents coupled by the conditions at a step, (agents, agents), and the distance of coupled agents,
        metres."""
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
            if graph is not None and graph.by_distance and not spacing:
                ties[np.ix_(graph.agents, graph.agents)] = True
                spacing.append(0.8 * min((reach for reach in all_ranges(graph) if reach > 0), default=graph.radius))
        return ties, min(spacing, default=0.0)

    def _packed(self, before: Array, places: dict[Region, list[int]], pitch: float = 1.0) -> Array:
        """Positions with the agents of each region in slots around its centre, with the least total motion: (agents,
        dim), metres."""
        guess = before.copy()
        for region, agents in places.items():
            slots = self.places.slots(region, agents, pitch)
            middle = before[agents].mean(axis=0)
            around = before[agents] - middle
            _, chosen = linear_sum_assignment(cdist(around, slots - slots.mean(axis=0), "sqeuclidean"))
            guess[agents] = slots[chosen]
        return guess

    def _exact(self, step: int) -> dict[int, Array]:
        points = {agent: tour[step] for agent, tour in self.toured.items()}
        for agent, place in self.mission.ends_at(step):
            if place.point is not None:
                points[agent.index] = np.array(place.point)
        return points

    def _pinned(self, step: int) -> Flags:
        pinned = np.zeros(len(self.mission.agents), dtype=np.bool_)
        pinned[list(self._exact(step))] = True
        return pinned


def _rotations(figure: Array, before: Array, angles: tuple[float, ...]) -> Iterator[Array]:
    """Rotations of a figure, (members, dim) around its middle, and of its mirror image, metres.

    The first of each has the least squared paths from the places before, up to a common one (Schönemann, 1966).

    Args:
        angles: further ones, degrees.
    """
    mirrored = figure.copy()
    mirrored[:, 1] = -mirrored[:, 1]
    around = before - before.mean(axis=0)
    for each in (figure, mirrored):
        turns = complex(np.sum((around[:, 0] + 1j * around[:, 1]) * (each[:, 0] - 1j * each[:, 1])))
        nearest = turned_by(each, math.degrees(cmath.phase(turns)))
        yield nearest
        yield from (turned_by(nearest, angle) for angle in angles if angle)
