"""Symbol map between two versions of a mission: agents, graphs and predicates of the first version in the second.

    in   two missions; the second contains the remaining agents
    out  agents, graphs and predicates of the second mission that correspond to those of the first

Lost agents map to None, and so do predicates that have no meaning without them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace

from missionc import ir
from missionc.ir.kernel.nodes import All, Always, Any, Atom, Eventually, Is, Node, Not
from missionc.ir.kernel.normal_form import truth


class SymbolMap:
    """Map from symbols of a mission to the symbols of its successor; regions and beacons correspond by name.

    Args:
        flags: by flag name, the agents of the first mission with the flag set one step before the second begins.
    """

    def __init__(self, before: ir.Mission, after: ir.Mission, flags: Mapping[str, frozenset[int]]) -> None:
        self.before, self.after, self.was_set = before, after, flags
        self.same = before is after
        index = {agent.name: agent.index for agent in after.agents}
        self._agents = {agent.index: index.get(agent.name) for agent in before.agents}
        self.lost = frozenset(agent for agent, new in self._agents.items() if new is None)
        self._regions = {each.name: each for each in after.regions}
        self._beacons = {each.name: each for each in after.beacons}
        self._named_graphs = {each.name: each for each in after.graphs}
        self._flags = {each.name: each for each in after.flags}
        self._resources = {(each.name, agent): each for each in after.resources for agent in each.agents}
        self._graphs: dict[ir.Graph, ir.Graph] = {}
        self._atoms: dict[tuple[ir.Predicate, bool], Node | None] = {}

    def agent(self, index: int) -> int | None:
        """Index in the second mission of an agent of the first; None if the agent is lost."""
        return self._agents[index]

    def agents(self, indices: Iterable[int]) -> tuple[int, ...]:
        """Indices in the second mission of the given agents that remain."""
        return tuple(new for each in indices if (new := self._agents[each]) is not None)

    def region(self, region: ir.Region) -> ir.Region:
        return self._regions.get(region.name, region)

    def graph(self, graph: ir.Graph) -> ir.Graph:
        """Graph of the second mission for a graph of the first, over its remaining agents."""
        if graph not in self._graphs:
            now = self._named_graphs.get(graph.name, graph)
            members = self.agents(graph.agents)
            self._graphs[graph] = now if members == now.agents else replace(now, agents=members)
        return self._graphs[graph]

    def formation(self, formation: ir.Formation) -> ir.Formation:
        """Formation of the remaining agents, with the edges between them."""
        if not self.lost and all(self._agents[each] == each for each in formation.agents):
            return formation
        edges = []
        for edge in formation.edges:
            first, second = self._agents[edge.first], self._agents[edge.second]
            if first is not None and second is not None:
                edges.append(replace(edge, first=first, second=second))
        return replace(formation, agents=self.agents(formation.agents), edges=tuple(edges))

    def atom(self, predicate: ir.Predicate, holds: bool) -> Node | None:
        """Predicate of the second mission, or its negation if not ``holds``; None if the predicate names only lost
        agents."""
        key = predicate, holds
        if key not in self._atoms:
            self._atoms[key] = self._atom(predicate, holds)
        return self._atoms[key]

    def _atom(self, predicate: ir.Predicate, holds: bool) -> Node | None:
        left = predicate if self.lost.isdisjoint(predicate.others) else predicate.among(predicate.others - self.lost)
        if left is None:
            of_whoever_is_left = predicate.graph is not None or predicate.formation is not None
            return truth(holds) if of_whoever_is_left else None
        match left:
            case ir.Compare():
                return self._compared(left, holds)
            case ir.Connected(graph, agents, order):
                return _signed(ir.Connected(self.graph(graph), self.agents(agents), order), holds)
            case ir.InFormation(formation):
                return _signed(ir.InFormation(self.formation(formation)), holds)
            case ir.Flagged(flag):
                return self._flagged(flag, holds)
            case _:
                return _signed(self._of_places(left), holds)

    def _of_places(self, predicate: ir.Predicate) -> ir.Predicate:
        """Predicate with its regions and beacons at their positions in the second mission."""
        told = {field.name: getattr(predicate, field.name) for field in fields(predicate)}
        now = {name: self._place(value) for name, value in told.items() if isinstance(value, ir.Region | ir.Beacon)}
        return replace(predicate, **now) if now else predicate  # type: ignore[arg-type]  # the fields are its own

    def _place(self, place: ir.Region | ir.Beacon) -> ir.Region | ir.Beacon:
        known: Mapping[str, ir.Region | ir.Beacon] = self._regions if isinstance(place, ir.Region) else self._beacons
        return known.get(place.name, place)

    def _compared(self, predicate: ir.Compare, holds: bool) -> Node:
        """Comparison in the second mission; for a resource, one comparison per agent, since initial levels differ."""
        names = [feature.resource.name for _, feature in predicate.terms if isinstance(feature, ir.Level)]
        owners = {agent for name, agent in self._resources if name in names}

        def of(agent: int | None) -> Node:
            terms = tuple((weight, self._feature(feature, agent)) for weight, feature in predicate.terms)
            return _signed(predicate if terms == predicate.terms else replace(predicate, terms=terms), holds)

        if not names:
            return of(None)
        own = [All((Is(frozenset((agent,))), of(agent))) for agent in sorted(owners)]
        others = frozenset(each.index for each in self.after.agents) - owners
        return Any((*own, *([All((Is(others), of(None)))] if others else [])))

    def _feature(self, feature: ir.Feature, agent: int | None) -> ir.Feature:
        match feature:
            case ir.DistanceTo(ir.Region() as region):
                return ir.DistanceTo(self.region(region))
            case ir.DistanceTo(ir.Beacon() as beacon):
                return ir.DistanceTo(self._beacons.get(beacon.name, beacon))
            case ir.DistanceTo(int(other)):
                return ir.DistanceTo(self._left(other))
            case ir.DistanceBetween(first, second):
                return ir.DistanceBetween(self._left(first), self._left(second))
            case ir.Level(resource):
                now = None if agent is None else self._resources.get((resource.name, agent))
                return ir.Level(now or replace(resource, agents=()))
            case _:
                return feature

    def _left(self, index: int) -> int:
        new = self._agents[index]
        assert new is not None, "predicates that name who is lost are gone"
        return new

    def _flagged(self, flag: ir.Flag, holds: bool) -> Node:
        """Formula that a flag is set: set in the second mission, or set before and not cleared since; or its
        negation."""
        now = self._flags[flag.name]
        since = _signed(ir.Flagged(now), holds)
        was_set = Is(frozenset(self.agents(self.was_set.get(flag.name, frozenset()))))
        if now.cleared_in is None:
            return Any((since, was_set)) if holds else All((since, Not(was_set)))
        cleared, back = Atom(ir.Inside(now.cleared_in, False)), -self.before.steps
        if holds:
            return Any((since, All((was_set, Always(Not(cleared), back, 0)))))
        return All((since, Any((Not(was_set), Eventually(cleared, back, 0)))))


def _signed(predicate: ir.Predicate, holds: bool) -> Node:
    return Atom(predicate) if holds else Not(Atom(predicate))
