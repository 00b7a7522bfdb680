"""Kept distances of one agent: what it keeps from others that are planned, as tensors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission


def kept_from(mission: Mission, agent: int, others: Sequence[int], like: Tensor) -> tuple[Tensor, Tensor]:
    """Metres sideways from centre to centre, (others,), and by what each axis of a difference counts, (others, dim)."""
    spacing, pair = SpacingTable.of(mission), (np.array(agent), np.array(others))
    metric = spacing.metric(*pair)
    factors = torch.ones(len(others), mission.dimension) if metric is None else torch.from_numpy(metric)
    return torch.from_numpy(spacing.between(*pair)).to(like), factors.to(like)
