"""Signed distance of a batch of moving points to obstacles and to the world's bounds, in torch."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.optimise.obstacle_index import Obstacles
from missionc.ir import Box, Mission, Shape
from missionc.ir.distances.signed_distance import signed_distance


class Surroundings:
    """Static and moving surroundings of a mission, at ``parts`` instants per step.

    Source:
        [clot] III-B, MSD to the obstacles; IV-D.3 (II), obstacles that move.
    """

    def __init__(
        self, mission: Mission, parts: int, device: torch.device | None = None, dtype: torch.dtype = torch.float32
    ) -> None:
        self.mission, self.parts = mission, parts
        self.world = Box(mission.world.low, mission.world.high)
        times = np.arange(mission.steps * parts + 1, dtype=np.float64) * (float(mission.step) / parts)
        self.obstacles = Obstacles(mission, mission.obstacles, times, str(dtype).removeprefix("torch."))
        self.moved, self.grown = (
            torch.from_numpy(each).to(device) for each in (self.obstacles.moved, self.obstacles.grown)
        )

    def room(self, points: Tensor, instants: Tensor, radius: float) -> Tensor:
        """Distance of a body from obstacles minus the clearance, and of its centre from the bounds.

        Args:
            points: centres, (..., instants, others, dim), metres.
            instants: (instants,), int64, times of the points in parts of a step.
            radius: body radius, metres.

        Returns:
            (..., instants, others), metres, negative if too near; at most ``REACH``.
        """
        reach = 0.4  # metres beyond a body's need within which obstacles count
        need = radius + self.mission.clearance
        # The number of near obstacles must be read, which would stall a GPU; there all obstacles are evaluated.
        near = self.all_near if points.device.type == "cpu" else self.all_of_them
        return torch.minimum(near(points, instants, need + reach) - need, -_distance(self.world, points))

    def all_near(self, points: Tensor, instants: Tensor, reach: float) -> Tensor:
        """Distance of points, as in ``room``, from obstacles, at most ``reach``.

        Shape: (..., instants, others), metres.
        """
        instant = instants[:, None].expand(points.shape[:-1]).reshape(-1)
        room = self.obstacles.room(points.reshape(-1, points.shape[-1]).numpy(), instant.numpy(), reach)
        return torch.from_numpy(room).reshape(points.shape[:-1])

    def all_of_them(self, points: Tensor, instants: Tensor, reach: float) -> Tensor:
        """The same, (..., instants, others), metres, without reading a number: one obstacle after the other."""
        left = torch.full_like(points[..., 0], reach)
        moved, grown = (iter(each[instants].unbind(1)) for each in (self.moved, self.grown))
        for obstacle in self.obstacles.solid:
            if obstacle.constant:
                away = _distance(obstacle.shape, points)
            else:
                away = _distance(obstacle.shape, points - next(moved)[:, None]) - next(grown)[:, None]
            left = torch.minimum(left, away)
        return left


def _distance(shape: Shape, points: Tensor) -> Tensor:
    distance = signed_distance(torch, shape, points)
    assert isinstance(distance, Tensor)
    return distance
