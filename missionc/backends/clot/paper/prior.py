"""Gaussian process prior over waypoints, for sampling candidates, and the kernel that smooths their steps.

Waypoints are positions at the mission's steps. Their second differences are white noise, so that likely trajectories
turn and accelerate gently. Samples satisfy known values (ends, positions to pass) exactly.
"""

from __future__ import annotations

from typing import TypeAlias, assert_never

import torch
from torch import Tensor

from missionc.base.late_dataclass import Record


class Fixed(Record, eq=False):
    """Prescribed end of a trajectory: ``position`` is (dim,) or (batch, dim), metres; at rest, or at any velocity."""

    position: Tensor
    at_rest: bool = True


class Free(Record):
    """Free end of a trajectory, at any position and velocity."""


End: TypeAlias = Fixed | Free


class Prior(Record, eq=False):
    """Gaussian distribution over trajectories, one for each candidate.

    Args:
        mean: (batch, steps, dim), metres, float32: the trajectory of least acceleration through the pinned waypoints.
        pinned: (batch, steps), bool: waypoints equal to the mean in every sample.
        root: (batch, steps, steps), float64: lower Cholesky factor of the precision (1/m²), identity in the pinned
            rows.
    """

    mean: Tensor
    pinned: Tensor
    root: Tensor

    def sample(self, generator: torch.Generator, scale: float = 1.0) -> Tensor:
        """Random trajectory for each candidate.

        Args:
            scale: factor on the deviation from the mean; 0 gives the mean.

        Returns:
            (batch, steps, dim), metres, float32.
        """
        noise = torch.randn(self.mean.shape, generator=generator, dtype=torch.float64, device=generator.device)
        noise = noise.to(self.mean.device).masked_fill(self.pinned[..., None], 0.0)
        deviation: Tensor = torch.linalg.solve_triangular(self.root.mT, noise, upper=True)
        return self.mean + (scale * deviation).to(self.mean.dtype)


def prior(steps: int, start: End, finish: End, acceleration: float, via_steps: Tensor, via_positions: Tensor) -> Prior:
    """Prior distribution of a batch of candidates.

    Args:
        steps: number of waypoints of a trajectory, including its ends; at least 3.
        acceleration: standard deviation of a second difference in each coordinate, metres per step²; more than 0.
        via_steps: (batch, places), int64: step at which a candidate passes a position, from 0 to ``steps - 1``. If a
            step occurs twice, the last position counts, and a fixed end has priority.
        via_positions: (batch, places, dim), metres: the positions to pass; (batch, 0, dim) for none.

    Raises:
        ValueError: too little is known for a proper distribution: a candidate needs two pinned waypoints, or one that
            is an end at rest.

    Source:
        [clot] IV-B.3, step (I), with positions for states: the velocities of the paper's prior are independent of the
        positions, so that no trajectory has both.
    """
    device = via_positions.device
    batch, places, dim = via_positions.shape
    pinned = torch.zeros(batch, steps, dtype=torch.bool, device=device)
    known = torch.zeros(batch, steps, dim, dtype=torch.float64, device=device)
    candidates = torch.arange(batch, device=device)
    for place in range(places):
        pinned[candidates, via_steps[:, place]] = True
        known[candidates, via_steps[:, place]] = via_positions[:, place].double()
    for end, step in ((start, 0), (finish, steps - 1)):
        match end:
            case Fixed(position):
                pinned[:, step] = True
                known[:, step] = position.double()
            case Free():
                pass
            case _:
                assert_never(end)
    differences = _second_differences(steps, _rests(start), _rests(finish)).to(device)
    if batch and int(pinned.sum(1).min()) + _rests(start) + _rests(finish) < 2:
        raise ValueError("a candidate needs two pinned waypoints, or a fixed end at rest")
    precision = (differences.mT @ differences) / acceleration**2
    # Pinned waypoints leave the system: their rows and columns become the identity's. They then hold exactly, and the
    # conditioning of the rest is independent of them.
    known = known * pinned[..., None]
    pull = torch.where(pinned[..., None], known, -(precision @ known))
    free = ~pinned
    remaining = precision * (free[:, :, None] & free[:, None, :]) + torch.diag_embed(pinned.double())
    root = torch.linalg.cholesky(remaining)
    mean = torch.cholesky_solve(pull, root)
    return Prior(mean.float(), pinned, root)


def smoother(fixed: Tensor, width: float) -> Tensor:
    """Matrix that spreads a displacement of one waypoint over its neighbours in time.

    The matrix is a Gaussian kernel with rows of sum 1, faded out towards fixed waypoints. No waypoint therefore moves
    further than the longest displacement, and fixed waypoints neither move nor have influence.

    Args:
        fixed: (steps,) or (batch, steps), bool.
        width: standard deviation of the kernel, and the reach of the fading, steps; more than 0.

    Returns:
        (steps, steps) or (batch, steps, steps), dimensionless weights, float32.
    """
    steps = torch.arange(fixed.shape[-1], dtype=torch.float32, device=fixed.device)
    apart = (steps[:, None] - steps).abs()
    kernel = torch.softmax(-0.5 * (apart / width) ** 2, dim=-1)
    nearest = torch.where(fixed[..., None, :], apart, torch.inf).amin(-1)
    window = (nearest / width).clamp(max=1.0)
    return window[..., :, None] * kernel * window[..., None, :]


def _rests(end: End) -> bool:
    return isinstance(end, Fixed) and end.at_rest


def _second_differences(steps: int, rests_first: bool, rests_last: bool) -> Tensor:
    """Matrix of second differences, (steps - 2 … steps, steps), dimensionless, float64; an end at rest continues for
    one more step."""
    rows = torch.zeros(steps, steps, dtype=torch.float64)
    rows.diagonal().fill_(-2.0)
    rows.diagonal(1).fill_(1.0)
    rows.diagonal(-1).fill_(1.0)
    rows[0, 0] = rows[-1, -1] = -1.0
    return rows[0 if rests_first else 1 : steps if rests_last else steps - 1]
