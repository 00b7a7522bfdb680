"""Residuals of one candidate, place by place, in metres, each with its gradient: rows of a sparse Jacobian.

A residual is the shortfall of a margin from its target; it reads one to four points of the motion. Its exact derivative
by these points is a row of a sparse matrix, from one backward pass over all residuals.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.optimise.control_points import Arguments
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags

Function = Callable[..., Tensor]
"""Function from points, (residuals, dim) each, to the margin's shortfall, (residuals,); only positive parts count."""


class Group(Record, eq=False):
    """Residuals of one kind.

    Args:
        name: subject, for reports.
        arguments: points that each residual reads, equally many.
        shortfall: function of those points; rows are independent.
        spare: part of the target beyond a positive margin, metres.
    """

    name: str
    arguments: tuple[Arguments, ...]
    shortfall: Function
    weight: float
    spare: float


class Rows(Record, eq=False):
    """Relevant residuals of a group, linearised.

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
        """Select rows, (rows,)."""
        where = np.flatnonzero(some)
        arguments = tuple(argument.take(where) for argument in self.arguments)
        gradient = tuple(each[where] for each in self.gradient)
        return Rows(self.name, self.weight, self.spare, self.value[where], arguments, gradient)


@torch.enable_grad()  # torch may have lost `no_grad`: an interruption on entry never leaves it
def rows(group: Group, control: Array, near: float = 0.0) -> Rows:
    """Violated rows of a group at these control points, (agents, points, dim), metres, with gradients.

    Args:
        near: metres; also include rows that would be violated if worse by this.
    """
    # Functions may carry a number per row: they are evaluated for all rows, and read for violated ones.
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
