"""Obstacles and the world's bounds around a batch of moving points: the room they leave, in torch."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from missionc.ir import Box, Mission, Path
from missionc.world.clearance import offset
from missionc.world.distance import signed_distance


class Surroundings:
    """What of a mission stands or moves around, at instants ``parts`` to a step.

    Source:
        [clot] III-B, MSD to the obstacles; IV-D.3 (II), obstacles that move.
    """

    def __init__(self, mission: Mission, parts: int, device: torch.device | None = None) -> None:
        self.mission, self.parts = mission, parts
        self.world = Box(mission.world.low, mission.world.high)
        times = np.arange(mission.steps * parts + 1) * (float(mission.step) / parts)
        self.moved = [
            torch.from_numpy(np.stack([offset(obstacle.motion, time, mission.dimension) for time in times]))
            .float()
            .to(device)
            if isinstance(obstacle.motion, Path)
            else None
            for obstacle in mission.obstacles
        ]

    def room(self, points: Tensor, instants: Tensor, radius: float) -> Tensor:
        """How far a body keeps from obstacles, less the clearance, and its centre from the bounds.

        Args:
            points: centres, (..., instants, others, dim), metres.
            instants: (instants,), int64, where the points are, counted in parts of a step.
            radius: of the body, metres.

        Returns:
            (..., instants, others), metres, negative where it is too near.
        """
        room = -_distance(self.world, points)
        need = radius + self.mission.clearance
        for obstacle, moved in zip(self.mission.obstacles, self.moved, strict=True):
            relative = points if moved is None else points - moved.to(points.dtype)[instants][:, None]
            room = torch.minimum(room, _distance(obstacle.shape, relative) - need)
        return room


def _distance(shape: object, points: Tensor) -> Tensor:
    distance = signed_distance(torch, shape, points)  # type: ignore[arg-type]
    assert isinstance(distance, Tensor)
    return distance
