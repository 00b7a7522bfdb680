"""Requirements split into conjuncts, each with its named agents, and with shorter windows.

A requirement on every drone has one part per drone, and a part applies as soon as its agents are planned. Agents
therefore need not all be planned at once (``prioritized_planning``). With iterative deepening, events are first
searched early, in a smaller problem.

Source:
    Biere et al., "Symbolic Model Checking without BDDs" (1999): growing bounds of bounded model checking.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from missionc.backends.smt.prioritized.reservations import Exclusion
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.ir.kernel.analysis import helped_by_more
from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Atom, Eventually, Kernel, Node, Until
from missionc.ir.kernel.walk import bottom_up, children, conjuncts, postorder, rebuilt, same_objects

Agents = frozenset[int]
NOBODY: Agents = frozenset()


class Part(Record, eq=False):
    """Part of a requirement: a formula that must be satisfied at step 0.

    Args:
        named: named agents that it restricts.
        monotone: True if additional agents can make it true but never false.
    """

    formula: Node
    named: Agents
    monotone: bool


class RequirementParts(Record, eq=False):
    """Requirements split into parts, per-agent forbidden states, and exclusions.

    ``never`` has the forbidden states of some agents, (steps + 1, states). No part repeats the conditions of ``never``
    and ``exclusions``.
    """

    parts: tuple[Part, ...]
    never: dict[int, Flags]
    exclusions: tuple[Exclusion, ...]

    def excluded(self, present: Agents) -> list[Node]:
        """Exclusions on the present agents if all others avoid the states, as formulas at step 0."""
        asked = ((each.conjunct.windows, each.among(present)) for each in self.exclusions)
        return [throughout(windows, node) for windows, node in asked if node is not None]


def split_requirements(kernel: Kernel, labels: Labels) -> RequirementParts:
    """Requirements of a kernel split into parts."""
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
    """Formula that the node holds over all of these nested windows, the outermost first."""
    for window in reversed(tuple(windows)):
        node = Always(node, window.low, window.high, window.span)
    return node


def own_formulas(formula: Node, agent: int) -> list[Node]:
    """Formulas at step 0 that a requirement states about this agent by name."""
    return [
        throughout(conjunct.windows, conjunct.formula) for conjunct in conjuncts((formula,)) if conjunct.agent == agent
    ]


def named_agents(roots: Iterable[Node]) -> dict[Node, Agents]:
    """Named agents that each formula restricts, for these formulas and their subformulas."""
    return bottom_up(roots, lambda node, below: agents_named_by(node).union(*below))


def agents_named_by(node: Node) -> Agents:
    """Agents that a node itself names, without its children."""
    match node:
        case At(agent):
            return frozenset((agent,))
        case Atom(predicate):
            return predicate.others
        case _:
            return NOBODY


def restricted_to(formula: Node, named: dict[Node, Agents], present: Agents) -> Node | None:
    """Stronger formula that restricts only present agents; None if no such formula exists.

    If some of many agents suffice, they must be among the present agents.
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
    """Parts that apply to the present agents, except guaranteed parts, with each formula restricted to these agents."""
    formulas = {
        part: restricted_to(part.formula, named, present) for part in requirements.parts if part not in guaranteed
    }
    return {part: formula for part, formula in formulas.items() if formula is not None}


def deepened(formulas: Sequence[Node], steps: int, first: int) -> Iterator[list[Node]]:
    """Yield the formulas with short windows, then with longer windows, and finally unchanged.

    Args:
        steps: last step of the mission, the end of unbounded windows.
        first: maximum length of the first windows, steps; doubled each time.
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
    """Formula with its ``eventually`` and ``until`` windows at step 0 reduced to ``longest`` steps; unchanged if no
    window is twice as long."""
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
