"""Asked shapes: the formations and graphs that an outline asks for, and whom they tie to others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from missionc.backends.clot.schedule.gather_team import can_be_gathered
from missionc.backends.clot.schedule.presence import PresenceConstraints
from missionc.backends.clot.schedule.tasks import Hold, Outline
from missionc.ir import Predicate
from missionc.ir.kernel.nodes import Atom, Node
from missionc.ir.kernel.walk import graph_of, postorder


def tied_agents(outline: Outline, company: PresenceConstraints, *, links: bool = True) -> frozenset[int]:
    """The agents of whom a formation or links are asked for, at any time, and who always has to be near one of them.

    Args:
        links: whether links tie those of whom they are asked for.
    """
    tied: set[int] = set()
    for node in _asked(outline):
        if not links and reads_links(node):
            continue
        graph = graph_of(node)
        if graph is not None:
            tied.update(graph.agents)
        elif isinstance(node, Atom) and (node.predicate.formation is not None or node.predicate.graph is not None):
            tied.update(node.predicate.others)
    left = list(company.meetings)
    while near := [each for each in left if not tied.isdisjoint(each.agents)]:
        tied.update(*(each.agents for each in near))
        left = [each for each in left if each not in near]
    return frozenset(tied)


def reads_links(node: Node) -> bool:
    """Whether a node is about the links of a graph."""
    return graph_of(node) is not None or (isinstance(node, Atom) and node.predicate.graph is not None)


def formations(outline: Outline) -> tuple[Predicate, ...]:
    """The formations that are asked for, at any time, each once."""
    found = (node.predicate for node in _asked(outline) if isinstance(node, Atom))
    return tuple(dict.fromkeys(each for each in found if each.formation is not None))


def shapes(holds: tuple[Hold, ...]) -> Iterator[Predicate]:
    """The formations and graphs that holds ask for, each once."""
    seen: set[Predicate] = set()
    for hold in holds:
        node = hold.node
        if isinstance(node, Atom) and can_be_gathered(node.predicate) and node.predicate not in seen:
            seen.add(node.predicate)
            yield node.predicate


def _asked(outline: Outline) -> Iterable[Node]:
    """The formulas of all holds, those of events included, and what they are made of."""
    holds = [*outline.fixed, *(hold for event in outline.events for hold in (*event.holds, *event.before))]
    return postorder(dict.fromkeys(hold.node for hold in holds))
