"""Slow paths: roadmap edges with local speed limits, fast outside a limited area and slow inside.

    in   Ground, the kernel, nodes and Edges
    out  for edges that touch a limit, positions at their steps

At constant speed, an edge is too fast in an area with a speed limit. On a slow path, a move that touches such an area
at either end is slow, and all others have full length.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from missionc.backends.smt.roadmap.edges import Edges
from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.settings import smt_settings
from missionc.backends.speed_limits import slowness
from missionc.base.trace import Array
from missionc.geometry.dynamics import States, speeds, turn_in_step
from missionc.ir.kernel.nodes import Atom, Kernel, Node
from missionc.ir.kernel.walk import conjuncts, postorder


def slow_paths(ground: Ground, kernel: Kernel, nodes: States, edges: Edges) -> Iterator[tuple[int, Array]]:
    """Yield edges that touch a speed limit, with their positions at the steps, (count + 1, dim), metres.

    Nothing is yielded for dynamics with momentum or bounded turning.
    """
    dynamics, step = ground.agents[0].dynamics, ground.mission.step
    if dynamics.has_momentum or np.isfinite(turn_in_step(dynamics, step)):
        return
    limits = _limits(ground, kernel)
    which = np.flatnonzero(edges.bend == 0) if limits else np.zeros(0, dtype=np.int64)
    if not which.size:
        return
    start = nodes.position[edges.source[which]]
    way = nodes.position[edges.target[which]] - start
    length, stride = np.linalg.norm(way, axis=1), speeds(dynamics)[1] * step
    pieces = np.maximum(
        np.ceil(length * smt_settings(ground.mission).roadmap.speed_samples / stride).astype(np.int64), 1
    )
    row = np.repeat(np.arange(len(which)), pieces + 1)
    first = np.concatenate([[0], np.cumsum(pieces + 1)])
    share = (np.arange(len(row)) - first[row]) / pieces[row]
    slower = np.ones(len(row))
    for agent, formulas in limits:
        found = slowness(ground.mission, agent, formulas, start[row] + share[:, None] * way[row])
        slower = slower if found is None else np.maximum(slower, found)
    for number, edge in enumerate(which.tolist()):
        at = slice(first[number], first[number + 1])
        if (slower[at] > 1).any():
            shares = _paced(share[at], slower[at], float(length[number]) / stride)
            yield edge, start[number] + shares[:, None] * way[number]


def _paced(share: Array, slower: Array, strides: float) -> Array:
    """Fraction of the path at each step, 0 to 1, (steps + 1,), with constant speed in each part with one limit.

    Args:
        share: samples on the path, (places,), as fractions 0 to 1.
        slower: time per metre at the samples, relative to that at full speed, (places,).
        strides: length of the path in longest steps, dimensionless.
    """
    rounding = 1e-9  # a piece does not get another step for this share of one
    within = np.maximum(slower[:-1], slower[1:])
    borders = np.flatnonzero(np.diff(within)) + 1
    ends = np.concatenate([[0], borders, [len(within)]])
    parts = [np.zeros(1)]
    for begin, end in pairwise(ends.tolist()):
        steps = (share[end] - share[begin]) * strides * within[begin]
        count = max(int(np.ceil(steps - rounding)), 1)
        parts.append(np.linspace(share[begin], share[end], count + 1)[1:])
    return np.concatenate(parts)


def always_slow(ground: Ground, kernel: Kernel) -> bool:
    """Return true if all agents of this kind must satisfy its speed limits at all steps, so that fast edges are
    unused."""
    asked: dict[Node, set[int]] = {}
    for conjunct in conjuncts(goal.formula for goal in kernel.requirements):
        if conjunct.agent is not None and conjunct.windows and _reads_speed(conjunct.formula):
            steps = conjunct.steps.indices(ground.mission.steps + 1) if conjunct.steps else (1, 0, 1)
            lasts = steps[0] == 0 and steps[1] >= ground.mission.steps
            asked.setdefault(conjunct.formula, set()).update((conjunct.agent,) if lasts else ())
    kind = {agent.index for agent in ground.agents}
    return all(kind <= agents for agents in asked.values())


def _limits(ground: Ground, kernel: Kernel) -> list[tuple[int, list[Node]]]:
    """Requirements on speeds over whole windows, for agents of this kind, each listed for its first agent."""
    asked: dict[Node, int] = {}
    kind = {agent.index for agent in ground.agents}
    for agent, windows, node in conjuncts(goal.formula for goal in kernel.requirements):
        if agent in kind and windows and _reads_speed(node):
            asked.setdefault(node, agent)
    agents = dict.fromkeys(asked.values())
    return [(agent, [node for node, first in asked.items() if first == agent]) for agent in agents]


def _reads_speed(formula: Node) -> bool:
    atoms = (node.predicate for node in postorder((formula,)) if isinstance(node, Atom))
    return any(predicate.reads_speed and not predicate.reads_heading for predicate in atoms)
