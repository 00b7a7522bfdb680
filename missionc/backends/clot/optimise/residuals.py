"""Residuals of one candidate, place by place, in metres, each with its gradient: rows of a sparse Jacobian.

A residual is the shortfall of a margin from its target; it reads one to four points of the motion. Its exact derivative
by these points is a row of a sparse matrix.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.backends.clot.optimise.control_points import Arguments
from missionc.backends.clot.optimise.dual_numbers import Values, variables
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags

Function = Callable[..., Values]
"""Function from points, (residuals, dim) each, to the shortfalls of margins, (residuals,); at most 0 if satisfied."""


class Group(Record, eq=False):
    """Residuals of one kind.

    Args:
        name: subject, for reports.
        arguments: points that each residual reads, equally many.
        shortfall: function of those points; rows are independent.
        spare: part of the target beyond a positive margin, metres.
        differentiated: True if the function of arrays returns dual numbers itself.
    """

    name: str
    arguments: tuple[Arguments, ...]
    shortfall: Function
    weight: float
    spare: float
    differentiated: bool = False


class Rows(Record, eq=False):
    """Relevant residuals of a group, linearised.

    Args:
        value: (rows,), metres.
        gradient: gradient of each value by each argument, (rows, dim) each.
    """

    name: str
    weight: float
    spare: float
    value: Array
    arguments: tuple[Arguments, ...]
    gradient: tuple[Array, ...]

    def taken(self, some: Flags) -> Rows:
        """Selected rows, by flags (rows,)."""
        where = np.flatnonzero(some)
        arguments = tuple(argument.take(where) for argument in self.arguments)
        gradient = tuple(each[where] for each in self.gradient)
        return Rows(self.name, self.weight, self.spare, self.value[where], arguments, gradient)


def rows(group: Group, control: Array, near: float = 0.0) -> Rows:
    """Linearised residuals of a group that are violated at these control points, (agents, points, dim), metres.

    Args:
        near: also include residuals that would be violated if they were worse by this amount, metres.
    """
    # Functions may carry a number per row: they are evaluated for all rows, and read for violated ones.
    points = [argument.of(control) for argument in group.arguments]
    found = group.shortfall(*(points if group.differentiated else variables(points)))
    some = np.flatnonzero(found.value > -near)
    gradient = found.partials[:, some].reshape(len(points), control.shape[-1], len(some)).swapaxes(1, 2)
    arguments = tuple(argument.take(some) for argument in group.arguments)
    return Rows(group.name, group.weight, group.spare, found.value[some], arguments, tuple(gradient))
