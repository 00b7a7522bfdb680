"""Initial candidates of one agent: drawn from the Gaussian process prior, or around its initial trajectory.

Source:
    [clot] Algorithm 1, line 1; IV-B.3 (I).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.paper.transport import Fixed, Free, prior
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.visits import KeyFrame, Schedule
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.polylines import at_shares
from missionc.ir import Mission


class FirstMotions(Record, eq=False):
    """Generator of initial candidates for single agents.

    Args:
        key: joint waypoints; the first contains the starts, and the last the finishes.
        schedule: schedule whose appointments candidates satisfy, or None.
        sketch: initial joint trajectory, (agents, steps + 1, dim), metres, or None.
        geodesics: geodesics of the mission, for paths around static obstacles.
        deviation: standard deviation of the prior half-way between two ends, metres.
        follows: True to draw half of the candidates of an agent with a parent around the parent's trajectory, if there
            is no ``sketch``.
        targets: agents with a target, given by the last joint waypoint; an agent stays from the first joint waypoint on
            that has the agent at its target.
    """

    mission: Mission
    key: tuple[KeyFrame, ...]
    schedule: Schedule | None
    sketch: Array | None
    geodesics: Geodesics
    deviation: float
    follows: bool = False
    targets: frozenset[int] = frozenset()

    def fixed(self, agent: int) -> Tensor:
        """Return true for each fixed waypoint, (steps + 1,): the first, and the last if the agent has a finish."""
        fixed = torch.zeros(self.mission.steps + 1, dtype=torch.bool)
        fixed[0] = True
        fixed[-1] = self.mission.agents[agent].finish is not None
        return fixed

    def of(self, agent: int, parent: tuple[int, Array] | None, samples: int, generator: torch.Generator) -> Tensor:
        """Initial candidates of an agent, (samples, steps + 1, dim), metres.

        With an initial trajectory, the candidates have four equal parts. The first are close to the initial trajectory,
        and begin with the initial trajectory itself. The second pass the agent's joint waypoints on the agent's own
        path around static obstacles. The third are behind or ahead of ``parent``, an agent and its planned trajectory.
        The rest are drawn from the prior. If a team must pass one by one, the initial trajectory, which preserves the
        team's shape, does not fit, but other candidates may.
        """
        if self.sketch is None:
            beside = samples // 2 if self.follows and parent is not None else 0
            drawn = self._from_prior(agent, samples - beside, generator)
            if parent is None or not beside:
                return drawn
            return torch.cat([self._beside(agent, parent[1]) + self._from_prior(agent, beside, generator, True), drawn])
        count = (samples + 3) // 4
        around = torch.from_numpy(self.sketch[agent]).float().expand(count, -1, -1)
        noise = self._from_prior(agent, 3 * count, generator, still=True)
        noise[[0, count, 2 * count]] = 0.0
        own = self._own_way(agent, count, generator)
        along = around if parent is None else self._along(agent, *parent, count, generator)
        begun = torch.cat([around, own, along]) + noise
        begun[:, 0] = around[0, 0]
        return torch.cat([begun, self._from_prior(agent, count, generator)])[:samples]

    def _ends(self, agent: int) -> bool:
        """Return true if the agent has a final position."""
        return agent in self.targets or self.mission.agents[agent].finish is not None

    def _arrival(self, agent: int) -> int:
        """Step from which on the agent stays at its final position; the last step without a target."""
        arrival: int = self.mission.steps
        end = self.key[-1].position[agent]
        for frame in reversed(self.key if agent in self.targets else ()):
            if np.linalg.norm(frame.position[agent] - end) > self.mission.agents[agent].radius:
                return arrival
            arrival = max(2, frame.step)
        return int(self.mission.steps)

    def _beside(self, agent: int, motion: Array) -> Tensor:
        """Parent's trajectory shifted to the agent's own start, and to its end if it has one: (1, steps + 1, dim),
        metres."""
        arrival, end = self._arrival(agent), self.key[-1].position[agent]
        begin = self.key[0].position[agent] - motion[0]
        last = end - motion[arrival] if self._ends(agent) else begin
        share = np.minimum(np.arange(len(motion)) / arrival, 1.0)[:, None]
        beside = motion + (1 - share) * begin + share * last
        if self._ends(agent):
            beside[arrival:] = end
        return torch.from_numpy(beside).float()[None]

    def _own_way(self, agent: int, count: int, generator: torch.Generator) -> Tensor:
        """Trajectories between joint waypoints around static obstacles, early or late in between: (count, steps + 1,
        dim), metres."""
        # Share of the path between two key frames by which an agent is ahead or behind half-way; beyond 1/3 it
        # reverses.
        most_early = 0.3
        radius = self.mission.agents[agent].radius + self.mission.clearance
        early = (most_early * (2 * torch.rand(count, generator=generator) - 1)).numpy()
        early[0] = 0.0
        parts = [np.repeat(self.key[0].position[agent][None, None], count, axis=0)]
        for before, after in pairwise(self.key):
            start, end = before.position[agent], after.position[agent]
            way = self.geodesics.way(start, end, radius + 0.1, radius)
            way = np.stack([start, end]) if way is None else way
            share = np.arange(1, after.step - before.step + 1) / (after.step - before.step)
            parts.append(np.stack([at_shares(way, share + by * np.sin(np.pi * share)) for by in early]))
        return torch.from_numpy(np.concatenate(parts, axis=1)).float()

    def _along(self, agent: int, parent: int, motion: Array, count: int, generator: torch.Generator) -> Tensor:
        """Trajectories on the parent's path, earlier or later, and beside it only near joint waypoints: (count, steps +
        1, dim), metres."""
        most_late = 0.12  # share of the mission by which an agent passes a place before or after its parent
        steps = self.mission.steps
        late = (most_late * steps * (2 * torch.rand(count, generator=generator) - 1)).numpy()
        beside = torch.rand(count, generator=generator).round().numpy()
        at = [frame.step for frame in self.key]
        offset = np.stack([frame.position[agent] - frame.position[parent] for frame in self.key])
        time = np.arange(steps + 1.0)
        offsets = np.stack([np.interp(time, at, column) for column in offset.T], axis=1)
        nearest = np.abs(time[:, None] - np.array(at)).min(axis=1)
        away = np.minimum(nearest / max(1.0, most_late * steps), 1.0)
        tracks = []
        for by, side in zip(late, beside, strict=True):
            moment = np.clip(time - by * away, 0, steps)
            track = np.stack([np.interp(moment, time, column) for column in motion.T], axis=1)
            tracks.append(track + offsets * (1 - away * (1 - side))[:, None])
        return torch.from_numpy(np.stack(tracks)).float()

    def _from_prior(self, agent: int, samples: int, generator: torch.Generator, still: bool = False) -> Tensor:
        """Samples of the prior, (samples, steps + 1, dim), metres, with random scales; with ``still``, deviations from
        the mean only."""
        at_once = 1 << 13  # candidates drawn in one call, which no time limit can interrupt
        # Half-way between two ends at rest, T steps apart, the prior deviates by this multiple of T^1.5 accelerations.
        midway = 0.072
        if samples > at_once:
            blocks = [min(at_once, samples - done) for done in range(0, samples, at_once)]
            return torch.cat([self._from_prior(agent, block, generator, still) for block in blocks])
        steps, mission = self.mission.steps, self.mission
        dim = mission.dimension
        begin, end = (torch.from_numpy(frame.position[agent]).float() for frame in (self.key[0], self.key[-1]))
        via = self._appointments(agent)
        at = torch.tensor(sorted(via), dtype=torch.int64).expand(samples, -1)
        places = torch.tensor([list(map(float, via[step])) for step in sorted(via)]).reshape(len(via), dim)
        finish, arrival = Fixed(end) if self._ends(agent) else Free(), self._arrival(agent)
        acceleration = self.deviation / (midway * arrival**1.5)
        drawn = prior(arrival + 1, Fixed(begin), finish, acceleration, at, places.expand(samples, -1, -1))
        sample = drawn.sample(generator) - drawn.mean
        varied = 1.5 * torch.rand(samples, 1, 1, generator=generator) * sample
        made = varied if still else drawn.mean + varied
        return torch.cat([made, made[:, -1:].expand(-1, steps - arrival, -1)], dim=1)

    def _appointments(self, agent: int) -> Mapping[int, Array]:
        """Positions of the agent, (dim,), metres, by step, at its visits; from the joint waypoints."""
        if self.schedule is None:
            return {}
        steps = {
            appointment.step
            for appointment in self.schedule.appointments
            if any(one == agent for one, _ in appointment.visit.regions)
        }
        return {frame.step: frame.position[agent] for frame in self.key if frame.step in steps}
