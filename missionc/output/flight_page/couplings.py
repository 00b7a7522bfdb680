"""Communication links and formations of a live flight: which there were at each column, are broken, or at risk now.

in   Mission, the team's states, the plan that is followed
out  values that JSON can hold
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Formation, Graph, Mission
from missionc.ir.pair_ranges import directed
from missionc.language.margins.links import are_linked, link_margin
from missionc.language.margins.predicate_margins import formation_margin
from missionc.monitoring.live.samples import StepState
from missionc.output.report.pack import pack, thousandths

MOST_MEMBERS = 200
"""Agents of a graph whose links are drawn: those of more are a tangle, and take their time."""

EVERY = 0.1
"""Seconds of the mission after which links are looked for again."""

INSTANT = 1e-9
"""Seconds: moments that differ by less are the same."""

KEPT, AT_RISK, BROKEN = range(3)
"""How an edge of a formation stands."""

NOWHERE = 1e6
"""Metres: an agent in doubt by so much is nowhere, and has no link."""


def drawn_graphs(mission: Mission) -> tuple[Graph, ...]:
    """The graphs whose links are drawn."""
    return tuple(graph for graph in mission.graphs if 1 < len(graph.agents) <= MOST_MEMBERS)


def couplings_data(mission: Mission) -> dict[str, Any]:
    """What the page is told of them once: names, which way links lead, edges by the agents' numbers."""
    return {
        "graphs": [{"name": graph.name, "directed": directed(graph)} for graph in drawn_graphs(mission)],
        "formations": [
            {"name": each.name, "edges": [[edge.first, edge.second] for edge in each.edges]}
            for each in mission.formations
        ],
    }


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """By graph, which of its pairs are linked at a step: (pairs,)."""

    step: int
    links: Mapping[str, Flags]


class CouplingsRecord:
    """The links that began and ended at each column, and the formations' margins there.

    Args:
        columns: how many there will be.
    """

    def __init__(self, mission: Mission, columns: int) -> None:
        self._columns = columns
        self._changes: dict[str, list[NDArray[np.int64]]] = {}
        self._written: dict[str, Flags] = {}
        self.last = Links(-1, {})
        self._margins: dict[str, Array] = {}
        self.set_world(mission)

    def set_world(self, mission: Mission) -> None:
        """The same graphs and formations, perhaps with other ranges; of one that is new nothing is known before."""
        self.mission = mission
        for each in mission.formations:
            self._margins.setdefault(each.name, np.full((len(each.edges), self._columns), -np.inf))

    def take(self, state: StepState, column: int | None) -> None:
        """The team at a step, and which column that is, if any; steps come in their order."""
        known, seconds = _known(state), float(self.mission.step)
        if self.last.step < 0 or (state.step - self.last.step) * seconds > EVERY - INSTANT:
            found = {graph.name: _linked(graph, state.position, known) for graph in drawn_graphs(self.mission)}
            self.last = Links(state.step, found)
        if column is None:
            return
        for graph in drawn_graphs(self.mission):
            changes = self._changes.setdefault(graph.name, [])
            changes += [np.zeros((0, 3), dtype=np.int64)] * (column - len(changes))
            first, second = _pairs(graph)
            none = np.zeros(len(first), dtype=np.bool_)
            linked = self.last.links.get(graph.name, none)
            changed = linked ^ self._written.get(graph.name, none)
            changes.append(np.stack([first[changed], second[changed], linked[changed]], axis=1))
            self._written[graph.name] = linked
        for formation in self.mission.formations:
            self._margins[formation.name][:, column] = _edges(formation, state.position, known)

    def since(self, first: int, last: int) -> dict[str, Any]:
        """What a page does not know yet that knows the columns before the first one; nothing of it is written again."""
        changes = {
            graph.name: list(enumerate(self._changes.get(graph.name, [])[first:last], first))
            for graph in drawn_graphs(self.mission)
        }
        margins = {each.name: self._margins[each.name][:, first:last].copy() for each in self.mission.formations}
        return {"changes": changes, "margins": margins}


def packed(fresh: dict[str, Any]) -> dict[str, Any]:
    """``CouplingsRecord.since`` as a page reads it: changes are rows of column, two agents, and whether linked."""
    return {
        "changes": {name: pack(_rows(changes)) for name, changes in fresh["changes"].items()},
        "margins": {name: pack(thousandths(margins)) for name, margins in fresh["margins"].items()},
    }


def _rows(changes: list[tuple[int, NDArray[np.int64]]]) -> NDArray[np.int64]:
    whole = [np.concatenate([np.full((len(rows), 1), column), rows], axis=1) for column, rows in changes]
    return np.concatenate([np.zeros((0, 4), dtype=np.int64), *whole])


def couplings_now(mission: Mission, state: StepState, plan: Trace | None, last: Links) -> dict[str, Any]:
    """By graph the links that there are, are at risk or broken, as pairs of agents; how the edges of formations stand.

    At risk is what is there and will not be a step from now if everybody goes on like this, or what nobody can be sure
    of, as somebody was not seen. Broken is a link that the plan has now, and the team has not.

    Args:
        last: the links as they were found last.
    """
    known = _known(state)
    ahead = state.position + state.velocity * float(mission.step)
    graphs = {}
    for graph in drawn_graphs(mission):
        ends = np.stack(_pairs(graph))
        linked = last.links.get(graph.name, np.zeros(ends.shape[1], dtype=np.bool_)) & known[ends].all(axis=0)
        first, second = ends[:, linked]
        lasting = are_linked(graph, first, second, ahead[first], ahead[second])
        doubt = state.doubt[first] + state.doubt[second]
        unsure = lasting & (doubt > 0)
        one, other = first[unsure], second[unsure]
        lasting[unsure] = link_margin(graph, one, other, state.position[one], state.position[other]) > doubt[unsure]
        broken = np.zeros_like(linked)
        if plan is not None and state.step < plan.position.shape[1]:
            broken = _linked(graph, plan.position[:, state.step], np.ones_like(known)) & ~linked
        risk = np.stack([first[~lasting], second[~lasting]])
        chosen = {"linked": ends[:, linked], "risk": risk, "broken": ends[:, broken]}
        graphs[graph.name] = {name: pack(each.T) for name, each in chosen.items()}
    return {"graphs": graphs, "formations": {each.name: _standing(each, state, ahead) for each in mission.formations}}


def _known(state: StepState) -> Flags:
    """(agents,): who is somewhere."""
    return np.asarray((state.doubt < NOWHERE) & np.isfinite(state.position).all(axis=1))


def _pairs(graph: Graph) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The agents of each pair that may be linked, from the first to the second; once where links lead both ways."""
    members = np.array(graph.agents, dtype=np.int64)
    first, second = np.triu_indices(len(members), 1)
    if directed(graph):
        first, second = np.append(first, second), np.append(second, first)
    return members[first], members[second]


def _linked(graph: Graph, position: Array, known: Flags) -> Flags:
    """(pairs,): which of them are linked, of those who are somewhere; position: (agents, dim), metres."""
    first, second = _pairs(graph)
    near = known[first] & known[second]
    near[near] = are_linked(graph, first[near], second[near], position[first[near]], position[second[near]])
    return near


def _edges(formation: Formation, position: Array, known: Flags) -> Array:
    """(edges,), metres; of an agent that is nowhere nothing holds."""
    margins = [
        float(formation_margin(formation, edge, position[edge.first], position[edge.second]))
        if known[edge.first] and known[edge.second]
        else -np.inf
        for edge in formation.edges
    ]
    return np.array(margins)


def _standing(formation: Formation, state: StepState, ahead: Array) -> list[int]:
    known = _known(state)
    unsure = np.array([state.doubt[edge.first] + state.doubt[edge.second] for edge in formation.edges])
    margins, later = _edges(formation, state.position, known), _edges(formation, ahead, known)
    stands = np.where(margins < 0, BROKEN, np.where((margins < unsure) | (later < 0), AT_RISK, KEPT))
    return [int(each) for each in stands]
