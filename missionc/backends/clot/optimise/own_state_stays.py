"""Stays in regions that own states depend on: refills and flag regions of a trajectory, as formulas.

A level has no gradient towards its refill region, and a flag may be set at any of many steps. An agent that refills, or
sets or clears a flag as required, in an initial trajectory must therefore be in the region at the same steps. For the
level, only the path length remains to optimise; for the flag, only avoiding the other region in between.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.own_state_residuals import flag_pieces
from missionc.base.trace import Array, Flags
from missionc.ir import Compare, Flagged, Inside, Level, Mission, Resource
from missionc.ir.kernel.nodes import Always, At, Atom, Node
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.margins.resources import within


def with_stays(demand: Demand, position: Array, velocity: Array) -> Demand:
    """Goals with additional formulas that fix the stays of one trajectory in refill and flag regions.

    Shape: (agents, steps + 1, dim), metres and m/s.
    """
    mission, roots = demand.mission, demand.roots
    atoms = {node.predicate for node in postorder(roots) if isinstance(node, Atom)}
    if not any(each.reads_past for each in atoms):
        return demand
    terms = [term for each in atoms if isinstance(each, Compare) for term in each.terms]
    resources = {feature.resource for _, feature in terms if isinstance(feature, Level)}
    read = [each for each in mission.resources if each in resources]
    stays = [*_refills(mission, read, position), *_settings(demand, position, velocity)]
    return Demand.of(mission, (*roots, *stays), demand.choices, mission.steps)


def _refills(mission: Mission, resources: list[Resource], position: Array) -> Iterator[Node]:
    for resource in resources:
        for refill in resource.refills:
            for agent in resource.agents:
                pinned = mission.agents[agent].start.point is not None
                for first, last in _stretches(np.asarray(within(refill.region, position[agent]))):
                    if first < last and (first > 0 or not pinned):
                        yield At(agent, Always(Atom(Inside(refill.region, False)), first, last))


def _settings(demand: Demand, position: Array, velocity: Array) -> Iterator[Node]:
    """Yield formulas for the steps that set and clear required flags; positions are (agents, steps, dim), metres."""
    for (predicate, holds), mask in demand.active(position, velocity).margins.items():
        if isinstance(predicate, Flagged):
            for region, inside, where in flag_pieces(predicate.flag, holds, mask, position):
                for agent, step in np.argwhere(where).tolist() if inside else ():
                    yield At(agent, Always(Atom(region), step, step))


def _stretches(inside: Flags) -> Iterator[tuple[int, int]]:
    """Yield the first and last step of each run of true values, (steps,)."""
    change = np.diff(np.concatenate([[0], inside.astype(np.int8), [0]]))
    yield from zip(np.flatnonzero(change > 0).tolist(), (np.flatnonzero(change < 0) - 1).tolist(), strict=True)
