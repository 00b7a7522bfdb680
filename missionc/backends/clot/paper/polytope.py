"""Regular polytopes with random rotations: their corners are the probing directions of a waypoint.

Source:
    [clot] Algorithm 1, line 4.
"""

from __future__ import annotations

import math
from itertools import product
from typing import assert_never

import torch
from torch import Tensor

from missionc.backends.clot.settings import Polytope


def directions(polytope: Polytope, dim: int) -> Tensor:
    """Corners of a polytope as unit vectors, (directions, dim), dimensionless, float64; ``dim`` is at least 1."""
    match polytope:
        case Polytope.SIMPLEX:
            # The unit vectors of dim + 1 axes, projected to the hyperplane across their mean (the rows of Helmert's
            # matrix).
            rows = [[1.0] * axis + [-float(axis)] + [0.0] * (dim - axis) for axis in range(1, dim + 1)]
            corners = torch.tensor(rows, dtype=torch.float64)
            lengths: Tensor = torch.linalg.vector_norm(corners, dim=1, keepdim=True)
            return (corners / lengths).mT * math.sqrt((dim + 1) / dim)
        case Polytope.ORTHOPLEX:
            axes = torch.eye(dim, dtype=torch.float64)
            return torch.cat([axes, -axes])
        case Polytope.CUBE:
            corners = torch.tensor(list(product((-1.0, 1.0), repeat=dim)), dtype=torch.float64)
            return corners / math.sqrt(dim)
        case _:
            assert_never(polytope)


def rotations(shape: tuple[int, ...], dim: int, generator: torch.Generator) -> Tensor:
    """Independent uniform random rotations (from the Haar measure).

    Returns:
        (*shape, dim, dim), dimensionless, float32, on the generator's device: orthogonal matrices with determinant 1.
    """
    if dim == 2:
        return _turns(torch.rand(shape, generator=generator, device=generator.device) * (2 * math.pi))
    if dim == 3:
        return _quaternions(torch.randn((*shape, 4), generator=generator, device=generator.device))
    gaussian = torch.randn((*shape, dim, dim), generator=generator, device=generator.device, dtype=torch.float64)
    orthogonal, triangular = torch.linalg.qr(gaussian)
    # The factors are unique, and the first one uniform, once the other's diagonal is positive.
    orthogonal = orthogonal * triangular.diagonal(dim1=-2, dim2=-1).sgn()[..., None, :]
    first = orthogonal[..., :1] * torch.linalg.det(orthogonal)[..., None, None]
    return torch.cat([first, orthogonal[..., 1:]], dim=-1).float()


def _turns(angle: Tensor) -> Tensor:
    """Rotation matrices of the plane by angles (...), rad: (..., 2, 2), dimensionless."""
    cos, sin = angle.cos(), angle.sin()
    return torch.stack([cos, -sin, sin, cos], dim=-1).reshape(*angle.shape, 2, 2)


def _quaternions(gaussian: Tensor) -> Tensor:
    """Rotation matrices of space, (..., 3, 3), dimensionless, from quaternions of any length, (..., 4).

    A uniform direction of the quaternion gives a uniform rotation.
    """
    length: Tensor = torch.linalg.vector_norm(gaussian, dim=-1, keepdim=True)
    w, x, y, z = (gaussian / length).unbind(-1)
    rows = [
        *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    ]
    return torch.stack(rows, dim=-1).reshape(*w.shape, 3, 3)
