"""Probe cost of entropic transport: an agent's cost with one of its waypoints moved to each probe position.

    static and moving obstacles, bounds    g_obs, at the waypoint and half-way to both its neighbours
    separation to the nearest planned     g_int, likewise
    robustness of the goals               by the paper's rules, on the planned agents and this agent
    speed, acceleration, smoothness       (2), in closed form

Source:
    [clot] (6) and (2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.paper.free_distance import Surroundings
from missionc.backends.clot.paper.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.motion_batch import Team
from missionc.backends.clot.paper.paper_rules import PaperRules
from missionc.backends.clot.paper.sparsity_pattern import SparsityPattern, sparsity_pattern
from missionc.backends.clot.paper.torch_device import places as at
from missionc.backends.clot.settings import ProbeWeights
from missionc.base.late_dataclass import Record
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Node


def kept_from(mission: Mission, agent: int, others: Sequence[int], like: Tensor) -> tuple[Tensor, Tensor]:
    """Required horizontal distance from each other agent, (others,), metres, and factors on the axes, (others, dim)."""
    spacing, pair = SpacingTable.of(mission), (np.array(agent), np.array(others))
    metric = spacing.metric(*pair)
    factors = torch.ones(len(others), mission.dimension) if metric is None else torch.from_numpy(metric)
    return torch.from_numpy(spacing.between(*pair)).to(like), factors.to(like)


PLACES = ((1.0, 0), (0.5, -1), (0.5, 1))
"""Points at which a moved waypoint is evaluated, with weights: the waypoint, and half-way to both neighbours."""


class ProbeCost(Record, eq=False):
    """Cost function of ``transport`` for one agent.

    Args:
        others: mission indices of the planned agents.
        goals: goals restricted to the planned agents and this agent (``prefix.about``).
        around: obstacles and bounds with two parts per step.
        reward: weight of a metre of the goals' mean robustness against a metre of a goal's shortfall.
        shares: weight of each goal's shortfall; 1 if not given.
        capped: True if robustness beyond the target does not count, for goals and parts.
    """

    mission: Mission
    team: Team
    agent: int
    others: tuple[int, ...]
    goals: tuple[Node, ...]
    around: Surroundings
    weights: ProbeWeights
    reward: float
    shares: tuple[float, ...] = ()
    capped: bool = False
    reads: SparsityPattern = field(init=False)
    counts: Tensor = field(init=False)

    def __post_init__(self) -> None:
        count, steps = len(self.mission.agents), self.mission.steps + 1
        every = sparsity_pattern(self.goals, self.agent, count, steps)
        mine = [place for place, goal in enumerate(self.goals) if goal in every.of]
        reads = sparsity_pattern([self.goals[place] for place in mine], self.agent, count, steps)
        object.__setattr__(self, "reads", reads)
        counts = torch.tensor([self.shares[place] if self.shares else 1.0 for place in mine])
        object.__setattr__(self, "counts", counts.to(self.team.radius))

    def __call__(self, waypoints: Tensor, probes: Tensor, planned: Tensor) -> Tensor:
        """Cost of each probe position: (batch, steps, probes), metres times weights.

        Args:
            waypoints: waypoints of the agent, (batch, steps, dim), metres.
            probes: (batch, steps, probes, dim), metres.
            planned: trajectories of ``others``, (batch or 1, others, steps, dim), metres.
        """
        before = torch.cat([waypoints[:, :1], waypoints[:, :-1]], dim=1)[:, :, None]
        after = torch.cat([waypoints[:, 1:], waypoints[:, -1:]], dim=1)[:, :, None]
        places = (probes, (probes + before) / 2, (probes + after) / 2)
        return (
            self._bodies(waypoints, places, planned)
            + self._motion(waypoints, probes)
            + self._task(waypoints, probes, planned)
        )

    def _bodies(self, waypoints: Tensor, places: tuple[Tensor, ...], planned: Tensor) -> Tensor:
        """Cost of obstacles, bounds and separation, g_obs and g_int: (batch, steps, probes), metres times weights.

        Source:
            [clot] III-B.
        """
        room = self.weights.room
        radius = self.mission.agents[self.agent].radius
        instants = 2 * torch.arange(waypoints.shape[1], device=waypoints.device)
        last = 2 * self.mission.steps
        cost = torch.zeros_like(places[0][..., 0])
        for (weight, half), points in zip(PLACES, places, strict=True):
            left = self.around.room(points, (instants + half).clamp(0, last), radius)
            cost = cost + weight * (room - left).clamp_min(0.0)
        if self.others:
            cost = cost + self._apart(waypoints, places, planned)
        return self.weights.bodies * cost

    def _apart(self, waypoints: Tensor, places: tuple[Tensor, ...], planned: Tensor) -> Tensor:
        nearest = 6  # planned agents whose separation counts at a waypoint
        planned = planned.expand(len(waypoints), -1, -1, -1)
        least, factors = kept_from(self.mission, self.agent, self.others, waypoints)
        need = (least + self.weights.room)[None, :, None].expand(planned.shape[:-1])
        scale = factors[None, :, None].expand(planned.shape)
        distance = torch.linalg.vector_norm((planned - waypoints[:, None]) * scale, dim=-1) - need
        near = distance.topk(min(nearest, len(self.others)), dim=1, largest=False).indices
        need = need.gather(1, near)[..., None]
        before = torch.cat([planned[:, :, :1], planned[:, :, :-1]], dim=2)
        after = torch.cat([planned[:, :, 1:], planned[:, :, -1:]], dim=2)
        cost = torch.zeros_like(places[0][..., 0])
        rows = near[..., None].expand(*near.shape, planned.shape[-1])
        scale = scale.gather(1, rows)[:, :, :, None]
        for (weight, _), points, other in zip(
            PLACES, places, (planned, (planned + before) / 2, (planned + after) / 2), strict=True
        ):
            apart = torch.linalg.vector_norm((points[:, None] - other.gather(1, rows)[:, :, :, None]) * scale, dim=-1)
            cost = cost + weight * (need - apart).clamp_min(0.0).sum(dim=1)
        return cost

    def _motion(self, waypoints: Tensor, probes: Tensor) -> Tensor:
        """Cost of speed, acceleration and bends: (batch, steps, probes); trajectories are extrapolated beyond their
        ends.

        ``waypoints`` is (batch, steps, dim), metres.

        Source:
            [clot] (2).
        """
        dynamics, step = self.mission.agents[self.agent].dynamics, float(self.mission.step)
        farthest = dynamics.top_speed * step
        ahead = torch.cat([waypoints[:, 1:], waypoints[:, -1:]], dim=1)[:, :, None]
        behind = torch.cat([waypoints[:, :1], waypoints[:, :-1]], dim=1)[:, :, None]
        cost = torch.zeros_like(probes[..., 0])
        for neighbour, inner in ((behind, slice(1, None)), (ahead, slice(None, -1))):
            far = torch.linalg.vector_norm(probes - neighbour, dim=-1) - 0.95 * farthest
            cost[:, inner] += self.weights.limits * far[:, inner].clamp_min(0.0)
        ends = [2 * waypoints[:, :1] - waypoints[:, 1:2], waypoints, 2 * waypoints[:, -1:] - waypoints[:, -2:-1]]
        bends = torch.cat(ends, dim=1).diff(dim=1).diff(dim=1)
        moved = probes - waypoints[:, :, None]
        if math.isfinite(dynamics.top_acceleration):
            most = 0.9 * dynamics.top_acceleration * step * step
            for share, bend in ((-2.0, bends), (1.0, _shifted(bends, 1)), (1.0, _shifted(bends, -1))):
                strong = torch.linalg.vector_norm(bend[:, :, None] + share * moved, dim=-1) - most
                cost += self.weights.limits * strong.clamp_min(0.0)
        slope = _shifted(bends, 1) - 2 * bends + _shifted(bends, -1)
        square = (moved * moved).sum(dim=-1)
        return cost + self.weights.bend * ((slope[:, :, None] * moved).sum(dim=-1) + 3 * square)

    def _task(self, waypoints: Tensor, probes: Tensor, planned: Tensor) -> Tensor:
        """Cost of each goal's shortfall, and a share of -ρ̂, the negative mean of the goals' robustness: (batch, steps,
        probes), metres.

        Source:
            [clot] IV-A.2, (6).
        """
        if not self.reads.goals:
            return torch.zeros_like(probes[..., 0])
        batch, steps, dim = waypoints.shape
        position = waypoints.new_zeros(batch, len(self.mission.agents), steps, dim)
        position[:, at(self.others, waypoints.device)] = planned
        position[:, self.agent] = waypoints
        part, whole = (self.weights.margin, self.weights.enough) if self.capped else (math.inf, UNLIMITED)
        values = PaperRules(self.reads, self.team, position, probes, part).goals().clamp(-UNLIMITED, whole)
        lacks = ((self.weights.margin - values).clamp_min(0.0) * self.counts[:, None, None, None]).sum(dim=0)
        return self.weights.task * (lacks - self.reward * values.mean(dim=0))


def _shifted(values: Tensor, by: int) -> Tensor:
    """Values of the next step (``by`` 1) or of the previous step (-1), 0 beyond the ends.

    Shape: (batch, steps, dim), metres -> (batch, steps, dim), metres.
    """
    nothing = torch.zeros_like(values[:, :1])
    return torch.cat([values[:, 1:], nothing] if by == 1 else [nothing, values[:, :-1]], dim=1)
