"""Margins of predicates and links, the leaves of the cost graph, for a batch of joint motions, in torch.

The formulas are those of ``missionc.language.margins.predicate_margins``, run on tensors; only the
connected graph is written for batches here.
"""

from __future__ import annotations

from typing import assert_never

import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.motion_batch import States, Team
from missionc.backends.clot.torch_device import places
from missionc.ir import (
    Compare,
    Connected,
    DistanceBetween,
    DistanceTo,
    Feature,
    Graph,
    InFormation,
    Inside,
    Predicate,
    Touches,
)
from missionc.language.margins import compare, formation, inside, region, touches
from missionc.language.margins.connected import restricted
from missionc.language.margins.predicate_margins import link_margin
from missionc.world.signed_distance import distance_between

UNLIMITED = 1e6
"""Metres: stands for a margin without limit, for arithmetic on infinities is not safe to average."""


def margin(predicate: Predicate, team: Team, states: States) -> Tensor:
    """A predicate's margin: (batch, agents, steps), agents 1 for a predicate about the team; metres.

    Source:
        [clot] III-C.
    """
    position = states.position
    match predicate:
        case Inside(place, body):
            if body:
                return _tensor(inside.margin(torch, place, team.radius, position))
            return _tensor(region.margin(torch, place, position))
        case Touches(place):
            return _tensor(touches.margin(torch, place, team.radius, position))
        case Compare():
            return _compare(predicate, team, states)
        case Connected():
            graph = restricted(predicate)
            links = all_links(graph, position)
            batch, steps = links.shape[:2]
            return bottleneck(links.flatten(0, 1)).reshape(batch, 1, steps)
        case InFormation(shape):
            return _tensor(formation.margin(torch, shape, position.movedim(1, 0)))[:, None]
        case _:
            assert_never(predicate)


def all_links(graph: Graph, position: Tensor) -> Tensor:
    """The link margins of all pairs of the graph's agents: (batch, steps, members, members), metres."""
    members = position[:, places(graph.agents, position.device)].transpose(1, 2)
    links = _tensor(link_margin(graph, members[:, :, :, None, :], members[:, :, None, :, :], xp=torch))
    own = torch.eye(len(graph.agents), dtype=torch.bool, device=links.device)
    return links.masked_fill(own, -UNLIMITED)


def bottleneck(links: Tensor) -> Tensor:
    """The worst link of each graph's best spanning tree (Prim's algorithm, all graphs at once).

    Args:
        links: (graphs, members, members), metres.

    Returns:
        (graphs,), metres; ``UNLIMITED`` for fewer than two members.
    """
    graphs, members, _ = links.shape
    worst = links.new_full((graphs,), UNLIMITED)
    if members < 2:
        return worst
    row, best = torch.arange(graphs, device=links.device), links[:, 0]
    inside_tree = torch.zeros((graphs, members), dtype=torch.bool, device=links.device)
    inside_tree[:, 0] = True
    for _ in range(members - 1):
        chosen = best.masked_fill(inside_tree, -2 * UNLIMITED).argmax(dim=1)
        worst = torch.minimum(worst, best[row, chosen])
        inside_tree[row, chosen] = True
        best = torch.maximum(best, links[row, chosen])
    return worst


def second_eigenvalue(weight: Tensor) -> Tensor:
    """λ₂ of weighted graphs: (..., members, members), symmetric, none on the diagonal -> (...).

    By each weight it changes as the square of the difference that its eigenvector has along that link.

    Source:
        [clot] III-C, λ₂(L); Fiedler, "Algebraic connectivity of graphs", 1973.
    """
    laplacian = torch.diag_embed(weight.sum(dim=-1)) - weight
    values: Tensor = torch.linalg.eigvalsh(laplacian)
    return values[..., 1]


def link_weight(link: Tensor, full: float) -> Tensor:
    """What links count in λ₂ by their margins, metres: 0 where there is none, 1 from ``full`` on, smooth in between."""
    share = (link / full).clamp(0.0, 1.0)
    return share * share * (3 - 2 * share)


def _compare(predicate: Compare, team: Team, states: States) -> Tensor:
    position, velocity = states.position, states.velocity

    def value(feature: Feature) -> Tensor:
        match feature:
            case DistanceTo(int() as target):
                return _tensor(distance_between(torch, position, position[:, target : target + 1]))
            case DistanceBetween(first, second):
                between = _tensor(distance_between(torch, position[:, first], position[:, second]))
                return between[:, None]
            case _:
                return _tensor(compare.own_feature(torch, feature, team.altitude, position, velocity))

    agents = slice(0, 1) if predicate.about_team else slice(None)
    return _tensor(compare.margin(predicate, team.mission.dimension, value)) + 0.0 * position[:, agents, :, 0]


def _tensor(value: object) -> Tensor:
    assert isinstance(value, Tensor)
    return value
