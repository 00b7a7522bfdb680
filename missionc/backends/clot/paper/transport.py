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
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias, assert_never

import torch
from torch import Tensor

from missionc.backends.clot.paper.polytope import directions, rotations
from missionc.backends.clot.paper.prior import smoother
from missionc.backends.clot.paper.sinkhorn import row_softmax, sinkhorn
from missionc.backends.clot.settings import Coupling, TransportSettings
from missionc.base.memory import reserve

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
