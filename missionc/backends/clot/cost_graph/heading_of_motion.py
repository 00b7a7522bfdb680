"""Headings of motions as the optimiser sees them: of who moves, by its velocity."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from missionc.ir import Beacon
from missionc.ir.language.margins.headings import of_motion


def facing(position: Tensor, velocity: Tensor, towards: float | Beacon, within: float) -> Tensor:
    """How much of the motion is to spare of leading within an angle of a direction: (..., dim) twice -> (...), m/s.

    It has the sign of the predicate's own margin where the agent moves, and 0 where it stands.
    """
    apart = 1e-9  # metres: the direction of a place that is nearer than this is any.
    along: tuple[Tensor | float, Tensor | float]
    if isinstance(towards, Beacon):
        x, y = (towards.position[axis] - position[..., axis] for axis in (0, 1))
        far = (x**2 + y**2 + apart**2).sqrt()
        along = x / far, y / far
    else:
        along = math.cos(towards), math.sin(towards)
    spare: Tensor = of_motion(torch, velocity[..., 0], velocity[..., 1], along, within)
    return spare
