"""Feasibility of one agent's candidates among those planned before it: every hard constraint, exactly.

Source:
    [clot] IV-D.1: only what satisfies all constraints by the standard semantics enters the tree.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.motion_batch import States, Team, velocities
from missionc.backends.clot.cost_graph.robustness import Robustness
from missionc.backends.clot.optimise.free_distance import Surroundings
from missionc.backends.clot.paper.kept_distance import kept_from
from missionc.backends.clot.torch_device import places
from missionc.kernel.nodes import Node
from missionc.kernel.walk import postorder


def prefix_margin(
    team: Team,
    agent: int,
    others: tuple[int, ...],
    candidates: Tensor,
    planned: Tensor,
    goals: tuple[Node, ...],
    around: Surroundings,
) -> Tensor:
    """The least margin of each candidate: obstacles, bounds, separation, limits and goals.

    Args:
        candidates: (batch, steps, dim), metres.
        others: mission indices of the planned agents; ``planned``: their motions,
            (batch or 1, others, steps, dim), metres.
        goals: ``prefix.about`` the planned agents and this one.
        around: obstacles are looked at so many times in each step.

    Returns:
        (batch,), metres; of speed and acceleration, in the metres they move in a step. Positive where all hold.

    Source:
        [clot] IV-D.1; II-B for the goals.
    """
    mission, count = team.mission, len(team.mission.agents)
    step, one = float(mission.step), mission.agents[agent]
    parts, batch = around.parts, len(candidates)
    share = (torch.arange(parts, device=candidates.device) / parts)[:, None].to(candidates)
    between = candidates[:, :-1, None] * (1 - share) + candidates[:, 1:, None] * share
    fine = torch.cat([between.flatten(1, 2), candidates[:, -1:]], dim=1)
    margin = (
        around.room(fine[:, :, None], torch.arange(fine.shape[1], device=fine.device), one.radius)
        .flatten(1)
        .amin(dim=1)
    )
    moved = candidates.diff(dim=1)
    far = torch.linalg.vector_norm(moved, dim=-1).amax(dim=1)
    margin = torch.minimum(margin, one.dynamics.top_speed * step - far)
    if math.isfinite(one.dynamics.top_acceleration):
        bend = torch.linalg.vector_norm(moved.diff(dim=1), dim=-1).amax(dim=1)
        margin = torch.minimum(margin, one.dynamics.top_acceleration * step * step - bend)
    if others:
        need, factors = kept_from(mission, agent, others, candidates)
        apart = _approach(candidates[:, None], planned, factors[:, None]).amin(dim=-1) - need
        margin = torch.minimum(margin, apart.amin(dim=1))
    if goals:
        position = candidates.new_zeros(batch, count, *candidates.shape[1:])
        position[:, places(others, candidates.device)] = planned
        position[:, agent] = candidates
        values = Robustness(team, States(position, velocities(position, step))).values(postorder(goals))
        for goal in goals:
            margin = torch.minimum(margin, values[goal][:, 0, 0].expand(batch))
    return margin


def _approach(one: Tensor, other: Tensor, factors: Tensor) -> Tensor:
    """The least distance within each step of points that move straight: (..., steps, dim) -> (..., steps - 1).

    Args:
        factors: (..., dim), by what each axis of a difference counts.
    """
    apart = (other - one) * factors
    change = apart.diff(dim=-2)
    apart = apart[..., :-1, :]
    square = (change * change).sum(dim=-1)
    when = (-(apart * change).sum(dim=-1) / square.clamp_min(1e-12)).clamp(0.0, 1.0)
    nearest: Tensor = torch.linalg.vector_norm(apart + change * when[..., None], dim=-1)
    return nearest
