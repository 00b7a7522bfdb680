"""Requirements split into conjuncts, each with the agents that it names.

A requirement of every drone is as many parts as there are drones, and a part can
be asked as soon as the agents it is about are there. So agents need not all be
planned at once (``prioritized_planning``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from missionc.backends.smt.roadmap.labels import Labels, others
from missionc.backends.smt.roadmap.own_state import own_state, states_of
from missionc.base.trace import Flags
from missionc.ir import InFormation
from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Kernel,
    Node,
    PathLength,
    Release,
    Route,
    Until,
)
from missionc.kernel.normal_form import rebuilt
from missionc.kernel.walk import children, postorder

Agents = frozenset[int]
NOBODY: Agents = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A formula that is required as a whole, at step 0.

    Args:
        asks: the agents it asks something of by name.
        grows: agents that join can only help it.
    """

    formula: Node
    named: Agents
    monotone: bool


@dataclass(frozen=True, slots=True, eq=False)
class RequirementParts:
    """The requirements as conjuncts.

    ``never``: for some agents, where they may not be, (steps + 1, states), whatever
    else; what that says is in no part.
    """

    parts: tuple[Part, ...]
    never: dict[int, Flags]


def split_requirements(kernel: Kernel, labels: Labels, roadmap_of: dict[int, int]) -> RequirementParts:
    """The requirements in parts.

    Args:
        roadmap_of: the number of each agent's roadmap.
    """
    never: dict[int, Flags] = {}
    formulas: list[Node] = []
    bodies: dict[tuple[tuple[Node, ...], Node], Node] = {}
    for agent, windows, node in _conjuncts(kernel):
        if agent is not None and len(windows) <= 1 and own_state(node, labels):
            roadmap = labels.roadmaps[roadmap_of[agent]]
            fails = ~states_of(node, agent, roadmap_of[agent], labels)
            forbidden = never.setdefault(agent, np.zeros(roadmap.standing.shape, dtype=np.bool_))
            low, high = (windows[0].low, windows[0].high) if windows else (0, 0)
            forbidden[low : None if high is None else high + 1] |= fails
            continue
        if (windows, node) not in bodies:
            body = node
            for window in reversed(windows):
                body = Always(body, window.low, window.high, window.span)
            bodies[windows, node] = body
        formulas.append(bodies[windows, node] if agent is None else At(agent, bodies[windows, node], node.span))
    named, monotone = named_agents(formulas), _monotone(formulas)
    return RequirementParts(tuple(Part(formula, named[formula], monotone[formula]) for formula in formulas), never)


def _conjuncts(kernel: Kernel) -> Iterator[tuple[int | None, tuple[Always, ...], Node]]:
    """Conjuncts: the agent or the team, the nested windows throughout which it must hold, and the formula."""
    work: list[tuple[int | None, tuple[Always, ...], Node]]
    work = [(None, (), goal.formula) for goal in reversed(kernel.requirements)]
    seen: set[tuple[int | None, tuple[Always, ...], Node]] = set()
    while work:
        what = work.pop()
        if what in seen:
            continue
        seen.add(what)
        agent, windows, node = what
        match node:
            case All(parts):
                work.extend((agent, windows, part) for part in reversed(parts))
            case Always(body):
                work.append((agent, (*windows, node), body))
            case At(who, body):
                work.append((who, windows, body))
            case _:
                yield what


def named_agents(roots: Iterable[Node]) -> dict[Node, Agents]:
    """The agents that each formula asks something of by name, for these formulas and what is below them."""
    named: dict[Node, Agents] = {}
    for node in postorder(roots):
        named[node] = agents_named_by(node).union(*(named[child] for child in children(node)))
    return named


def agents_named_by(node: Node) -> Agents:
    """The agents that the node by itself asks something of."""
    match node:
        case At(agent):
            return frozenset((agent,))
        case Atom(InFormation(formation)):
            return frozenset(formation.agents)
        case Atom(predicate):
            return others(predicate, -1)
        case _:
            return NOBODY


def _monotone(roots: Iterable[Node]) -> dict[Node, bool]:
    """Whether agents that join can only make the formula true."""
    monotone: dict[Node, bool] = {}
    for node in postorder(roots):
        match node:
            case EveryNeighbour() | EveryReach() | Route() | EveryRoute() | PathLength():
                monotone[node] = False
            case _:
                monotone[node] = all(monotone[child] for child in children(node))
    return monotone


def restricted_to(formula: Node, named: dict[Node, Agents], present: Agents) -> Node | None:
    """A formula that only asks something of agents who are there, and implies the one given; None if there is none.

    Where some of many will do, it must be some of those.
    """
    if named[formula] <= present:
        return formula
    made: dict[Node, Node | None] = {}
    for node in postorder((formula,)):
        made[node] = node if named[node] <= present else _restricted_to(node, made, present)
    return made[formula]


def _restricted_to(node: Node, made: dict[Node, Node | None], present: Agents) -> Node | None:
    left = tuple(part for part in (made[child] for child in children(node)) if part is not None)
    whole = len(left) == len(children(node))
    match node:
        case At(agent):
            return rebuilt(node, left) if whole and agent in present else None
        case Always() | Eventually() | Until() | Release():
            return rebuilt(node, left) if whole else None
        case All() | Any():
            if not (whole if isinstance(node, All) else left):
                return None
            return left[0] if len(left) == 1 else rebuilt(node, left)
        case AtLeast(count):
            return rebuilt(node, left) if 0 < count <= len(left) else None
        case _:
            return None
