"""Gradient-free optimisation by optimal transport: batches of trajectories move towards low cost.

Basis of the defaults: one robot of 4 m/s among up to 14 discs on 10 x 6 m, 48 steps of 0.1 s, 32 candidates sampled
from the prior, 20 random scenes. A scene counts as solved if a candidate is clear at and between its steps; some scenes
may have no solution. CPU time of one thread, cost included.

    changed                     solved   clear candidates   ms per scene
    nothing                         15               44 %            200
    coupling: Sinkhorn              15               43 %            350
    no smoothing                     1              0.2 %            260
    first width 5 steps             15               40 %            170
    first radius 0.6 m              15               36 %            190
    simplex                         15               41 %            120
    3 probes per direction          15               42 %            550
    no iteration                     2              0.6 %              0

Source:
    [clot] Algorithm 1.

Regular polytopes with random rotations: their corners are the probing directions of a waypoint.

Source:
    [clot] Algorithm 1, line 4.

Gaussian process prior over waypoints, for sampling candidates, and the kernel that smooths their steps.

Waypoints are positions at the mission's steps. Their second differences are white noise, so that likely trajectories
turn and accelerate gently. Samples satisfy known values (ends, positions to pass) exactly.

Entropic optimal transport (Sinkhorn): the mass that each waypoint assigns to each direction.

CPU time of one thread, for 48 waypoints, 4 directions and regulariser 0.08: 32 candidates take 0.2 ms by softmax and 9
ms by Sinkhorn's iteration. 800 candidates take 4 ms and 220 ms. On random costs the two methods differ by a tenth of
the mass, but no difference was seen over the iterations of a plan (numbers in ``transport``).

Source:
    [clot] equation (7), a problem for each candidate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import TypeAlias, assert_never

import torch
from torch import Tensor

from missionc.backends.clot.settings import Coupling, Polytope, TransportSettings
from missionc.base.late_dataclass import Record
from missionc.base.memory import reserve


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


CHECKED_EVERY = 5
"""Number of rounds between two checks of the marginals; each check waits for the device."""


def sinkhorn(costs: Tensor, regulariser: float, tolerance: float = 1e-4, limit: int = 200, shares: int = 1) -> Tensor:
    """Transport plan of least cost minus entropy with uniform marginals.

    Sinkhorn's iteration scales rows and columns of exp(-costs / regulariser), on logarithms in case of underflow. Each
    share of the batch stops independently.

    Args:
        costs: (batch, steps, directions), finite.
        regulariser: weight of the entropy, in units of cost; more than 0.
        tolerance: the iteration stops when the total error of the directions' masses is at most this in every
            candidate; the total mass is 1.
        limit: maximum number of rounds.
        shares: number of equal shares of the batch.

    Returns:
        (batch, steps, directions), at least 0: a waypoint's weights sum to 1/steps, up to rounding; a direction's sum
            to 1/directions, up to ``tolerance`` unless ``limit`` was reached.
    """
    # Costs that differ by more regularisers than this are scaled as logarithms; exp(-40) squared is still a float32.
    least_exponent = 40.0
    kernel = (costs - costs.amin(2, keepdim=True)) / -regulariser
    if float(kernel.min()) > -least_exponent:
        return _by_scaling(kernel.exp(), tolerance, limit, shares)
    return _by_logarithms(kernel, tolerance, limit, shares)


def _by_scaling(kernel: Tensor, tolerance: float, limit: int, shares: int = 1) -> Tensor:
    steps, ways = kernel.shape[1:]
    turned = kernel.mT.contiguous()
    row = kernel.new_full((len(kernel), steps, 1), 1.0 / steps)
    column, settled = torch.zeros_like(turned[:, :, :1]), None
    for done in range(1, limit + 1):
        column = _advanced(column, 1.0 / (ways * (turned @ row)), settled)
        row = _advanced(row, 1.0 / (steps * (kernel @ column)), settled)
        if done % CHECKED_EVERY == 0:
            settled = _settled((column * (turned @ row))[..., 0], tolerance, shares)
            if bool(settled.all()):
                break
    return kernel * row * column.mT


def _by_logarithms(kernel: Tensor, tolerance: float, limit: int, shares: int = 1) -> Tensor:
    steps, ways = kernel.shape[1:]
    row = torch.zeros_like(kernel[:, :, :1])
    column, settled = torch.zeros_like(kernel[:, :1, :]), None
    for done in range(1, limit + 1):
        column = _advanced(column, -math.log(ways) - torch.logsumexp(kernel + row, dim=1, keepdim=True), settled)
        row = _advanced(row, -math.log(steps) - torch.logsumexp(kernel + column, dim=2, keepdim=True), settled)
        if done % CHECKED_EVERY == 0:
            settled = _settled((kernel + row + column).exp().sum(1), tolerance, shares)
            if bool(settled.all()):
                break
    return (kernel + row + column).exp()


def _settled(received: Tensor, tolerance: float, shares: int) -> Tensor:
    """Return true for each candidate whose entire share of the batch has converged: (batch, 1, 1).

    Args:
        received: mass of each direction, (batch, directions).
    """
    off = (received - 1 / received.shape[1]).abs().sum(1)
    done = off.reshape(shares, -1).amax(1) <= tolerance
    return done.repeat_interleave(len(received) // shares)[:, None, None]


def _advanced(before: Tensor, after: Tensor, settled: Tensor | None) -> Tensor:
    return after if settled is None else torch.where(settled, before, after)


def row_softmax(costs: Tensor, regulariser: float) -> Tensor:
    """Transport plan without constraints on the directions' masses: each waypoint chooses independently.

    Args:
        costs: (batch, steps, directions), finite.
        regulariser: weight of the entropy, in units of cost; more than 0.

    Returns:
        (batch, steps, directions), at least 0: a waypoint's weights sum to 1/steps.
    """
    return torch.softmax(costs / -regulariser, dim=2) / costs.shape[1]


Cost: TypeAlias = Callable[[Tensor, Tensor], Tensor]
"""Function from waypoints (batch, steps, dim) and probes (batch, steps, probes, dim), metres, to the trajectory's cost
with only that waypoint moved to that probe: (batch, steps, probes), finite. Terms that no probe changes may be omitted.
Costs of fixed waypoints are ignored."""


def transport(
    waypoints: Tensor,
    fixed: Tensor,
    cost: Cost,
    settings: TransportSettings,
    generator: torch.Generator | Sequence[torch.Generator],
    done: Callable[[Tensor], bool] | None = None,
) -> Tensor:
    """Waypoints of a batch of trajectories after the iterations of Algorithm 1.

    Inside an iteration only ``done`` and ``Coupling.SINKHORN`` wait for the device.

    Args:
        waypoints: (batch, steps, dim), metres; not modified.
        fixed: (steps,) or (batch, steps), bool: waypoints that stay bitwise equal.
        cost: see ``Cost``. The costs may differ from call to call.
        generator: equal seeds give equal bytes on one kind of device. Several generators serve one equal share of the
            batch each, which moves independently.
        done: test of the waypoints, also at the beginning; True ends the run.

    Returns:
        (batch, steps, dim), metres, of the type of ``waypoints``.

    Raises:
        MemoryError: there is not enough memory for the trajectories.

    Source:
        [clot] Algorithm 1, with these differences. Every waypoint has a separate rotation: with a shared one, uniform
        marginals would fix the mean of a trajectory. Costs are scaled for each waypoint, so that one bad candidate
        cannot flatten the others. The update is smoothed over time: probes move a single waypoint, which would tear it
            from its neighbours. The iteration ends by ``done``, not when waypoints come to rest, which also happens at
            bad positions.
    """
    arrays = 12  # approximate arrays of all probes in memory at once
    batch, steps, dim = waypoints.shape
    generators = [generator] if isinstance(generator, torch.Generator) else generator
    shares = len(generators)
    corners = directions(settings.polytope, dim).to(waypoints)
    moved_to = len(corners) * settings.probes
    numbers = batch * steps * (dim * dim * 2 + dim * (len(corners) + moved_to) + arrays * moved_to)
    if not waypoints.is_cuda:
        reserve(numbers * waypoints.element_size(), f"{batch} trajectories of {steps} waypoints")
    # Farthest last; the same order for every direction, so that costs fold back into (directions, probes).
    fractions = torch.arange(1, settings.probes + 1).to(waypoints) / settings.probes
    with torch.no_grad():
        for iteration in range(settings.iterations):
            if done is not None and iteration % settings.check_every == 0 and done(waypoints):
                break
            radius, width = _schedule(settings, iteration)
            turns = torch.cat([rotations((batch // shares, steps), dim, each) for each in generators])
            turned = corners @ turns.to(waypoints).mT
            offsets = turned[..., None, :] * (radius * fractions)[:, None]
            probes = waypoints[:, :, None] + offsets.flatten(2, 3)
            costs = cost(waypoints, probes).reshape(offsets.shape[:-1]).mean(3).masked_fill(fixed[..., None], 0.0)
            weights = _weights(_scaled(costs, settings.flat * radius), settings, shares)
            step = (radius * steps) * (weights[..., None, :] @ turned).squeeze(-2)  # equation (8)
            moved = waypoints + smoother(fixed, width).to(waypoints) @ step
            waypoints = torch.where(fixed[..., None], waypoints, moved)
    return waypoints


def _schedule(settings: TransportSettings, iteration: int) -> tuple[float, float]:
    """Probing radius, metres, and width of the smoothing kernel, steps, in an iteration."""
    part = iteration / max(1, settings.iterations - 1)
    radius = settings.first_radius * (settings.last_radius / settings.first_radius) ** part
    return radius, settings.first_width + (settings.last_width - settings.first_width) * part


def _scaled(costs: Tensor, least: float) -> Tensor:
    """Costs of each waypoint scaled to [0, 1], 0 the best: (batch, steps, probes); the divisor is at least
    ``least``."""
    above = costs - costs.amin(-1, keepdim=True)
    return above / above.amax(-1, keepdim=True).clamp(min=least)


def _weights(costs: Tensor, settings: TransportSettings, shares: int) -> Tensor:
    match settings.coupling:
        case Coupling.SOFTMAX:
            return row_softmax(costs, settings.regulariser)
        case Coupling.SINKHORN:
            return sinkhorn(costs, settings.regulariser, shares=shares)
        case _:
            assert_never(settings.coupling)
