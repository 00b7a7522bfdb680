"""Margins of leaves under a perturbation: one agent moved at one step, to each of many places.

A leaf reads one step, so the moved places of a step stand side by side as if
they were steps of their own, and the formulas are those of ``leaf_margins``.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED, margin
from missionc.backends.clot.cost_graph.motion_batch import States, Team, velocities
from missionc.backends.clot.paper.sparsity_pattern import NodePattern
from missionc.backends.clot.torch_device import places
from missionc.ir import Graph, Predicate
from missionc.ir.language.margins.predicate_margins import link_margin


def moved_margin(
    predicate: Predicate, reading: NodePattern, team: Team, position: Tensor, agent: int, probes: Tensor
) -> Tensor:
    """A predicate's margin where a waypoint is moved: (batch, rows, steps, offsets, directions), metres.

    Args:
        reading: the rows, steps and offsets asked for.
        position: (batch, agents, steps, dim), metres.
        probes: where each waypoint of ``agent`` is moved to, (batch, steps, directions, dim), metres.
    """
    read = sorted({agent, *(reading.rows or ()), *predicate.others})
    own = read.index(agent)
    reads = places(read, position.device)
    sub = Team(team.mission, team.radius[reads], team.altitude[reads])
    here = slice(reading.first, reading.first + reading.steps)
    batch, _, directions, dim = probes.shape
    others = position[:, reads, here, None].expand(-1, -1, -1, directions, -1)
    speeds = _moved_velocities(position[:, agent], probes, team.mission.step) if predicate.reads_speed else ()
    values = []
    for offset in range(reading.low, reading.high + 1):
        moved = others
        if offset == 0:
            moved = others.clone()
            moved[:, own] = probes[:, here]
        speed = torch.zeros_like(moved)
        if speeds:
            speed[:] = velocities(position, team.mission.step)[:, reads, here, None]
            speed[:, own] = speeds[offset + 1][:, here]
        states = States(*(each.reshape(batch, len(read), -1, dim) for each in (moved, speed)))
        value = margin(predicate, sub, states, read)
        rows = [0] if reading.rows is None else [read.index(row) for row in reading.rows]
        values.append(value[:, places(rows, value.device)].reshape(batch, len(rows), reading.steps, directions))
    return torch.stack(values, dim=3)


def moved_links(graph: Graph, position: Tensor, agent: int, probes: Tensor, here: slice, back: bool) -> Tensor:
    """The margins of links from the moved agent to the graph's agents, or with ``back`` from these to it.

    (batch, members, steps, directions), metres.
    """
    members = np.array(graph.agents, dtype=np.int64)
    others, moved = position[:, places(graph.agents, position.device), here, None, :], probes[:, None, here]
    named = members[:, None, None]
    links = (
        link_margin(graph, named, agent, others, moved, xp=torch)
        if back
        else link_margin(graph, agent, named, moved, others, xp=torch)
    )
    assert isinstance(links, Tensor)
    links[:, graph.agents.index(agent)] = -UNLIMITED
    return links


def _moved_velocities(own: Tensor, probes: Tensor, step: float) -> tuple[Tensor, Tensor, Tensor]:
    """Velocities of the moved agent, (batch, steps, directions, dim), m/s.

    At each step, where the waypoint before it, its own, or the one after it is
    moved. The one before it counts at the last step alone.
    """
    own = own[:, :, None].expand_as(probes)
    still = velocities(own.transpose(1, 2), step).transpose(1, 2)
    if own.shape[1] < 2:
        return still, still, still
    before = torch.cat([still[:, :-1], (own[:, -1:] - probes[:, -2:-1]) / step], dim=1)
    at = torch.cat([(own[:, 1:] - probes[:, :-1]) / step, (probes[:, -1:] - own[:, -2:-1]) / step], dim=1)
    after = torch.cat([(probes[:, 1:] - own[:, :-1]) / step, still[:, -1:]], dim=1)
    return before, at, after
