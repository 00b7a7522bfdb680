"""Batches of joint motions as tensors, and the mission's numbers for formulas."""

from __future__ import annotations

import torch
from torch import Tensor

from missionc.base.late_dataclass import Record
from missionc.ir import Mission


class States(Record, eq=False):
    """Candidates at the steps.

    Args:
        position: (batch, agents, steps, dim), metres.
        velocity: (batch, agents, steps, dim), m/s, as in ``base.trace.Trace``.
    """

    position: Tensor
    velocity: Tensor


class Team(Record, eq=False):
    """The mission's agents as tensors on the planner's device.

    Args:
        radius: (agents, 1), metres; likewise ``altitude``.
    """

    mission: Mission
    radius: Tensor
    altitude: Tensor


def team(mission: Mission, device: torch.device | None = None, dtype: torch.dtype = torch.float32) -> Team:
    """Agents of a mission as tensors."""
    return Team(
        mission,
        torch.tensor([[agent.radius] for agent in mission.agents], dtype=dtype, device=device),
        torch.tensor([[agent.altitude] for agent in mission.agents], dtype=dtype, device=device),
    )


def velocities(position: Tensor, step: float) -> Tensor:
    """First-order velocities, constant within a step, the last one repeated.

    Shape: (..., steps, dim), metres -> the same shape, m/s.

    Shape: (..., steps, dim) -> the same, m/s.
    """
    if position.shape[-2] < 2:
        return torch.zeros_like(position)
    moved = (position[..., 1:, :] - position[..., :-1, :]) / step
    return torch.cat([moved, moved[..., -1:, :]], dim=-2)
