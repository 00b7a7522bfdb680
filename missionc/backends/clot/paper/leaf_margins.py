"""Margins of predicates and links, the leaves of the cost graph, for a batch of joint motions in torch.

Predicates measure tensors like traces; only the connected graph has a separate batch version.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.paper.motion_batch import States, Team
from missionc.backends.clot.paper.torch_device import places
from missionc.ir import Beacon, Flag, Graph, Predicate, Resource
from missionc.ir.couplings import directed
from missionc.ir.language.margins.headings import of_velocity
from missionc.ir.language.margins.predicate_margins import link_margin
from missionc.ir.language.margins.resources import flag_margins_along, levels_along
from missionc.ir.language.margins.view import View

UNLIMITED = 1e6
"""Metres: replaces an infinite margin, since averages of infinities are unsafe."""


def margin(predicate: Predicate, team: Team, states: States, agents: Sequence[int] | None = None) -> Tensor:
    """Margin of a predicate: (batch, agents, steps), with 1 agent for a team predicate; metres.

    Args:
        agents: indices of the agents in the team and the states, if not all of the mission's.

    Source:
        [clot] III-C.
    """
    return _tensor(predicate.margin(_OfBatch(team, states, agents or range(states.position.shape[1]))))


def all_links(graph: Graph, position: Tensor, agents: Sequence[int] | None = None) -> Tensor:
    """Link margins of all pairs of the graph's agents.

    Shape: (batch, steps, members, members), from and to, metres.

    Args:
        agents: indices of the agents in the positions, if not all of the mission's.
    """
    numbers = np.array(graph.agents, dtype=np.int64)
    at = graph.agents if agents is None else tuple(map(agents.index, graph.agents))
    members = position[:, places(at, position.device)].transpose(1, 2)
    here, there = members[:, :, :, None, :], members[:, :, None, :, :]
    links = _tensor(link_margin(graph, numbers[:, None], numbers, here, there, xp=torch))
    own = torch.eye(len(graph.agents), dtype=torch.bool, device=links.device)
    return links.masked_fill(own, -UNLIMITED)


def bottleneck(links: Tensor) -> Tensor:
    """Worst link of each graph's best spanning tree (Prim's algorithm, all graphs at once).

    For directed links, of the best tree of paths from the first member to all others.

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


class _OfBatch(View):
    """View of all agents: (batch, agents, steps, dim); for one agent (batch, 1, steps, dim)."""

    def __init__(self, team: Team, states: States, agents: Sequence[int]) -> None:
        super().__init__(torch, team.mission.dimension)
        self.team, self.states, self.agents = team, states, agents

    def own(self) -> Tensor:
        return self.states.position

    def place(self, agent: int) -> Tensor:
        here = self.agents.index(agent)
        return self.states.position[:, here : here + 1]

    def velocity(self) -> Tensor:
        return self.states.velocity

    def facing(self, towards: float | Beacon, within: float) -> Tensor:
        return _tensor(of_velocity(torch, self.own(), self.velocity(), towards, within))

    def nothing(self, *, of_team: bool = False) -> Tensor:
        return 0.0 * self.states.position[:, : 1 if of_team else None, :, 0]

    def radius(self) -> Tensor:
        return self.team.radius

    def plane(self) -> Tensor:
        return self.team.altitude

    def weakest_link(self, graph: Graph) -> Tensor:
        links = all_links(graph, self.states.position, self.agents)
        worst = bottleneck(links.flatten(0, 1))
        if directed(graph):
            worst = torch.minimum(worst, bottleneck(links.flatten(0, 1).mT))
        return worst.reshape(links.shape[0], 1, links.shape[1])

    def level(self, resource: Resource) -> Tensor:
        return _tensor(levels_along(torch, resource, self.team.mission.step, self.states.position))

    def flagged(self, flag: Flag) -> Tensor:
        found = _tensor(flag_margins_along(torch, flag, self.states.position))
        stranger = torch.tensor([agent not in flag.agents for agent in self.agents], device=found.device)
        return found.masked_fill(stranger[:, None], -UNLIMITED)


def _tensor(value: object) -> Tensor:
    assert isinstance(value, Tensor)
    return value
