"""Transport settings: how Algorithm 1 moves a batch; every figure of it in one value.

Source:
    [clot] Algorithm 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto


class Polytope(Enum):
    """A set of directions that sum to zero."""

    SIMPLEX = auto()
    """dim + 1 corners: the fewest."""
    ORTHOPLEX = auto()
    """2 dim corners: both ways along each axis."""
    CUBE = auto()
    """2^dim corners."""


class Coupling(Enum):
    """Whether the waypoints of a candidate share the directions evenly."""

    SOFTMAX = auto()
    """Each waypoint chooses by itself."""
    SINKHORN = auto()
    """Every direction receives the same mass, as equation (7) has it."""


@dataclass(frozen=True, slots=True)
class TransportSettings:
    """How a batch is moved. Radii and widths run from their first to their last value over the iterations.

    The defaults suit trajectories drawn from the prior in a world of about
    10 m; a good guess wants smaller radii.

    Args:
        iterations: at most so many; at least 0.
        first_radius, last_radius: how far a waypoint looks and at most moves in
            an iteration, metres; in between geometric.
        first_width, last_width: of the kernel that smooths a step, steps;
            in between linear.
        regulariser: weight of the entropy, for costs scaled to [0, 1].
        flat: where the best and the worst probe of a waypoint differ by less
            than this times the radius (cost per metre), it moves less.
        polytope: the directions probed.
        probes: on each direction, at equal distances up to the radius.
        coupling: how the weights are found.
        check_every: iterations between two calls of ``done``.
    """

    iterations: int = 20
    first_radius: float = 1.0
    last_radius: float = 0.06
    first_width: float = 8.0
    last_width: float = 0.8
    regulariser: float = 0.08
    flat: float = 0.3
    polytope: Polytope = Polytope.ORTHOPLEX
    probes: int = 1
    coupling: Coupling = Coupling.SOFTMAX
    check_every: int = 5
