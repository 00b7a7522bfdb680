"""Requirements split into conjuncts, each with the agents that it names, and with shorter windows.

A requirement of every drone is as many parts as there are drones, and a part can be asked as soon as the agents it is
about are there. So agents need not all be planned at once (``prioritized_planning``). With iterative deepening an event
is searched early first, where a problem is smaller.

Source:
    Biere et al., "Symbolic Model Checking without BDDs" (1999): bounds that grow, of bounded model checking.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missionc.backends.smt.prioritized.exclusions import Exclusion
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.trace import Flags
from missionc.ir.kernel.analysis import helped_by_more
from missionc.ir.kernel.conjuncts import conjuncts
from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Atom, Eventually, Kernel, Node, Until
from missionc.ir.kernel.walk import bottom_up, children, postorder, rebuilt, same_objects

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
    else; what that says is in no part, and what ``exclusions`` say is in none either.
    """

    parts: tuple[Part, ...]
    never: dict[int, Flags]
    exclusions: tuple[Exclusion, ...]

    def excluded(self, present: Agents) -> list[Node]:
        """What the exclusions ask of those who are there while all others keep away, to be asked at step 0."""
        asked = ((each.conjunct.windows, each.among(present)) for each in self.exclusions)
        return [throughout(windows, node) for windows, node in asked if node is not None]


def split_requirements(kernel: Kernel, labels: Labels) -> RequirementParts:
    """The requirements in parts."""
    never: dict[int, Flags] = {}
    exclusions: list[Exclusion] = []
    formulas: list[Node] = []
    bodies: dict[tuple[tuple[Node, ...], Node], Node] = {}
    goals = [goal.formula for goal in kernel.requirements]
    own = own_states(postorder(goals), labels)
    for conjunct in conjuncts(goals):
        agent, windows, node = conjunct
        if agent is not None and conjunct.steps and node in own:
            fails = ~states_of(node, agent, labels)
            standing = labels.roadmaps[labels.roadmap_of[agent]].standing
            never.setdefault(agent, np.zeros(standing.shape, dtype=np.bool_))[conjunct.steps] |= fails
            continue
        exclusion = Exclusion.of(conjunct, labels)
        if exclusion is not None:
            exclusions.append(exclusion)
            continue
        if (windows, node) not in bodies:
            bodies[windows, node] = throughout(windows, node)
        formulas.append(bodies[windows, node] if agent is None else At(agent, bodies[windows, node], node.span))
    named, monotone = named_agents(formulas), helped_by_more(formulas)
    parts = tuple(Part(formula, named[formula], monotone[formula]) for formula in formulas)
    return RequirementParts(parts, never, tuple(exclusions))


def throughout(windows: Iterable[Always], node: Node) -> Node:
    """The formula throughout these windows, the outermost first."""
    for window in reversed(tuple(windows)):
        node = Always(node, window.low, window.high, window.span)
    return node


def own_formulas(formula: Node, agent: int) -> list[Node]:
    """What a requirement asks of this agent by name, to be asked of it at step 0."""
    return [
        throughout(conjunct.windows, conjunct.formula) for conjunct in conjuncts((formula,)) if conjunct.agent == agent
    ]


def named_agents(roots: Iterable[Node]) -> dict[Node, Agents]:
    """The agents that each formula asks something of by name, for these formulas and what is below them."""
    return bottom_up(roots, lambda node, below: agents_named_by(node).union(*below))


def agents_named_by(node: Node) -> Agents:
    """The agents that the node by itself asks something of."""
    match node:
        case At(agent):
            return frozenset((agent,))
        case Atom(predicate):
            return predicate.others
        case _:
            return NOBODY


def restricted_to(formula: Node, named: dict[Node, Agents], present: Agents) -> Node | None:
    """A formula that only asks something of agents who are there, and implies the one given; None if there is none.

    Where some of many will do, it must be some of those.
    """
    if named[formula] <= present:
        return formula
    if isinstance(formula, At) and formula.agent not in present:
        return None

    def restricted(node: Node, parts: tuple[Node | None, ...]) -> Node | None:
        return node if named[node] <= present else _restricted_to(node, parts, present)

    return bottom_up((formula,), restricted)[formula]


def _restricted_to(node: Node, parts: tuple[Node | None, ...], present: Agents) -> Node | None:
    left = tuple(part for part in parts if part is not None)
    whole = len(left) == len(parts)
    match node:
        case Any() if left:
            return left[0] if len(left) == 1 else rebuilt(node, left)
        case AtLeast(count):
            return rebuilt(node, left) if 0 < count <= len(left) else None
        case All((_,)) if whole:
            return left[0]
        case _ if whole and left and agents_named_by(node) <= present:
            return rebuilt(node, left)
        case _:
            return None


def applicable_parts(
    requirements: RequirementParts, named: dict[Node, Agents], guaranteed: set[Part], present: Agents
) -> dict[Part, Node]:
    """The parts that can be asked of those who are there, but for those guaranteed; each restricted to them."""
    formulas = {
        part: restricted_to(part.formula, named, present) for part in requirements.parts if part not in guaranteed
    }
    return {part: formula for part, formula in formulas.items() if formula is not None}


def deepened(formulas: Sequence[Node], steps: int, first: int) -> Iterator[list[Node]]:
    """The formulas with short windows, with longer ones, and last as they are.

    Args:
        steps: of the mission, where a window without end ends.
        first: steps of the first windows at most; each time twice as many.
    """
    longest = first
    while 2 * longest <= steps:
        shorter = [within_horizon(formula, longest, steps) for formula in formulas]
        if same_objects(shorter, formulas):
            break
        yield shorter
        longest *= 2
    yield list(formulas)


def within_horizon(formula: Node, longest: int, steps: int) -> Node:
    """The formula, asked at the first step, with windows of ``eventually`` and ``until`` that are no longer than this.

    Itself where none is twice as long.
    """
    match formula:
        case Eventually(low=low, high=high) | Until(low=low, high=high):
            last = steps if high is None else high
            return formula if last - low < 2 * longest else replace(formula, high=low + longest)
        case At() | All() | Any() | AtLeast():
            below = tuple(children(formula))
            inner = tuple(within_horizon(child, longest, steps) for child in below)
            return formula if same_objects(inner, below) else rebuilt(formula, inner)
        case _:
            return formula
