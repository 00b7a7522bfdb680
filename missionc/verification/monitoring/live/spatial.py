"""Robustness bounds of spatial operators during a flight.

The minimum value of an operator follows from the fewest links and the maximum value from the most; negation swaps them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Graph
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.nodes import NeighbourNode, PathLength, ReachNode, RouteNode
from missionc.ir.language.margins.links import link_pieces
from missionc.verification.monitoring import graph_routes
from missionc.verification.monitoring.live.windows import LEASTS, MOSTS, AtomBounds, denied
from missionc.verification.monitoring.logic import ROBUSTNESS, decided_at_border


class GraphHistory:
    """Links and member positions of a graph at the past steps that are still read, and links in the future cells."""

    def __init__(self, graph: Graph, kept: int) -> None:
        self.graph, self.kept = graph, kept
        self.links: list[Array] = []
        self.places: list[Array] = []
        self.certain: list[bool] = []
        self.cells: list[int] = []

    def extend(self, atoms: AtomBounds) -> None:
        """Append the present step: links (4, 1 + cells, members, members) and positions (members, dim), metres."""
        members, state = list(self.graph.agents), atoms.state
        found = atoms.links(self.graph)
        self.cells = atoms.picked(self.graph)
        # The future cells follow the known steps, until the next step is known.
        past = self.links[: len(self.places)][-self.kept :] if self.kept else []
        self.places = [*(self.places[-self.kept :] if self.kept else []), state.position[members, 0]]
        self.certain = [*(self.certain[-self.kept :] if self.kept else []), not np.any(state.doubt[members])]
        self.links = [*past, *found.swapaxes(0, 1)]

    def columns(self, where: Where) -> Array:
        """Robustness bounds of the links at past steps and in future cells: (4, columns, members, members), metres.

        Large graphs have only the first and last cell.
        """
        stop = len(self.places) - where.ago
        return np.stack(self.links[stop - where.count : stop + (len(self.cells) if where.cells else 0)], axis=1)


class Where(Record):
    """Selected columns of a formula: ``count`` known steps, the last of them ``ago`` steps back, and ``cells`` future
    cells.
    """

    count: int
    ago: int
    cells: int

    @property
    def columns(self) -> int:
        return self.count + self.cells


def neighbour(node: NeighbourNode, history: GraphHistory, body: Array, where: Where, agents: int) -> Array:
    """Robustness bounds of the operators "at some neighbour" and "at every neighbour": (4, agents, columns), metres."""
    outside = np.full((1, 1, 1), -np.inf)
    return _along(history, node.every, (body,), outside, where, agents, graph_routes.nearby)


def live_reach(node: ReachNode, history: GraphHistory, through: Array, end: Array, where: Where, agents: int) -> Array:
    """Robustness bounds of reachability over routes of at most ``hops`` links: (4, agents, columns), metres."""

    def measure(links: Array, through: Array, end: Array) -> Array:
        return graph_routes.reach(links, through, end, node.hops)

    return _along(history, node.every, (through, end), None, where, agents, measure)


def lengths_in_metres(
    node: RouteNode | PathLength,
    holds: bool,
    history: GraphHistory,
    below: tuple[Array, ...],
    where: Where,
    agents: int,
) -> Array:
    """Robustness bounds of reachability over routes with a bounded length in metres: (4, agents, columns), metres.

    In future cells, and if a member's position is unknown, the bounds are infinite.

    Args:
        below: for a route, the bounds of its operands, (4, rows, columns), metres.
        agents: number of agents of the mission.
    """
    opposite = node.every if isinstance(node, RouteNode) else not holds
    found = np.empty((4, agents, where.columns))
    found[LEASTS], found[MOSTS] = -np.inf, np.inf
    for column in range(where.count):
        back = column - where.count - where.ago
        if history.certain[back]:
            operands = tuple(each[:, :, column] for each in below)
            found[:, :, column] = _at_one_step(node, history, back, operands, opposite, agents)
    return found


def _at_one_step(
    node: RouteNode | PathLength,
    history: GraphHistory,
    back: int,
    below: tuple[Array, ...],
    opposite: bool,
    agents: int,
) -> Array:
    """Robustness bounds of an operator on route lengths at one known step: (4, agents), metres.

    Args:
        below: bounds of the operands, (4, rows), metres.
    """
    members, known = list(history.graph.agents), len(history.places)
    links = history.links[known + back]
    places = history.places[back]
    lengths = np.broadcast_to(distance_between(np, places[:, None], places[None, :]), links.shape)
    if isinstance(node, PathLength):
        target = np.where(np.arange(agents) == node.agent, np.inf, -np.inf)
        through, end = np.full((4, agents), np.inf), np.broadcast_to(target, (4, agents))
    else:
        through, end = (denied(each) if opposite else each for each in below)
        through, end = (np.broadcast_to(each, (4, agents)) for each in (through, end))
    outside = end if node.low <= 0 else np.full((4, agents), -np.inf)
    value = outside.copy()
    inner = through[:, members], end[:, members]
    if members:
        if isinstance(node, RouteNode) and node.low > 0:
            value[:, members] = graph_routes.bounded_below(ROBUSTNESS, links, lengths, *inner, node.low, node.high)
        else:
            value[:, members] = graph_routes.reach_within(ROBUSTNESS, links, lengths, *inner, node.high)
        if isinstance(node, PathLength) and node.low > 0:
            below_low = np.nextafter(node.low, 0.0)
            nearer = graph_routes.reach_within(ROBUSTNESS, links, lengths, *inner, float(below_low))
            value[:, members] = np.minimum(value[:, members], denied(nearer))
    value = denied(value) if opposite else value
    return decided_at_border(value, is_open=opposite)


def _along(
    history: GraphHistory,
    every: bool,
    below: tuple[Array, ...],
    outside: Array | None,
    where: Where,
    agents: int,
    measure: Callable[..., Array],
) -> Array:
    """Robustness bounds of a spatial operator, computed by ``measure`` for the members of a graph: (4, agents,
    columns), metres.

    Agents outside the graph have the value ``outside``, by default that of the last operand.
    """
    below = tuple(denied(each) if every else each for each in below)
    members, shape = list(history.graph.agents), (4, agents, where.columns)
    result = np.broadcast_to(below[-1] if outside is None else outside, shape).copy()
    if members:
        cells = [where.count + each for each in history.cells] if where.cells else []
        picked = [*range(where.count), *cells]
        inner = (np.broadcast_to(each, shape)[:, members][:, :, picked] for each in below)
        flat = [each.swapaxes(1, 2).reshape(-1, len(members)) for each in inner]
        rows = history.columns(where).reshape(-1, len(members), len(members))
        parts = [measure(rows[at], *(each[at] for each in flat)) for at in link_pieces(len(rows), len(members))]
        values = np.concatenate(parts).reshape(4, len(picked), len(members)).swapaxes(1, 2)
        # Cells between the first and the last one have the value of the last.
        result[:, members] = values[:, :, np.searchsorted(picked, np.arange(where.columns))]
    return denied(result) if every else result
