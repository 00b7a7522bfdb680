"""Residuals of one candidate, place by place, in metres, each with its gradient: rows of a sparse Jacobian.

A residual is how much a margin lacks of what is asked of it; it reads one to four points
of the motion and nothing else. So the derivative of each by its own points is a
row of a sparse matrix, exact, from one backward pass over all of them at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.optimise.control_points import Arguments
from missionc.base.trace import Array, Flags

Function = Callable[..., Tensor]
"""Points (residuals, dim) each -> (residuals,): the margin's shortfall, of which the part above 0 counts."""


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Residuals of one kind.

    Args:
        name: what they are about, for reports.
        arguments: the points each residual reads, as many for each.
        shortfall: of those points; rows are independent.
        spare: how much of it is more than the margin needs to be positive, metres.
    """

    name: str
    arguments: tuple[Arguments, ...]
    shortfall: Function
    weight: float
    spare: float


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The residuals of a group that matter, linearised.

    Args:
        value: (rows,), metres.
        gradient: for each argument (rows, dim).
    """

    name: str
    weight: float
    spare: float
    value: Array
    arguments: tuple[Arguments, ...]
    gradient: tuple[Array, ...]

    def taken(self, some: Flags) -> Rows:
        """Some of the rows, (rows,)."""
        where = np.flatnonzero(some)
        arguments = tuple(argument.take(where) for argument in self.arguments)
        gradient = tuple(each[where] for each in self.gradient)
        return Rows(self.name, self.weight, self.spare, self.value[where], arguments, gradient)


@torch.enable_grad()  # torch may be without: whoever was interrupted as it entered `no_grad` has never left it
def rows(group: Group, control: Array, near: float = 0.0) -> Rows:
    """What of a group is amiss at these control points, (agents, points, dim), and how that changes.

    Args:
        near: metres; also what would be amiss if it were worse by so much.
    """
    # Functions may carry a number per row: they are asked about all rows, and read where something is amiss.
    leaves = [torch.from_numpy(argument.of(control)).requires_grad_() for argument in group.arguments]
    value = group.shortfall(*leaves)
    some = np.flatnonzero(value.detach().numpy() > -near)
    arguments = tuple(argument.take(some) for argument in group.arguments)
    if not some.size:
        none = tuple(np.zeros((0, control.shape[-1])) for _ in arguments)
        return Rows(group.name, group.weight, group.spare, np.zeros(0), arguments, none)
    chosen = value[torch.from_numpy(some)]
    gradients = torch.autograd.grad(chosen.sum(), leaves, allow_unused=True)
    return Rows(
        group.name,
        group.weight,
        group.spare,
        chosen.detach().numpy(),
        arguments,
        tuple(
            np.zeros((len(some), control.shape[-1])) if gradient is None else gradient.numpy()[some]
            for gradient in gradients
        ),
    )
