"""Bounds of predicates and links now and in cells of future steps, from the agents' top speeds.

A cell is a range of steps. Even long missions have few cells; the next step and deadlines end a cell of their own.
Future positions are known only from the distance that agents can move until then, so bounds widen from step to step,
and the bounds at a cell's last step hold for the complete cell.

Source:
    Deshmukh, Donzé, Ghosh, Jin, Juniwal, Seshia, "Robust online monitoring of signal temporal logic" (2017), robust
    satisfaction intervals; there the future is completely unknown.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.ir import Flag, Flagged, Graph, Predicate
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.language.margins.links import all_links
from missionc.verification.monitoring.live.team_state import COASTED, NOW, Reach, TeamState, TeamView
from missionc.verification.monitoring.logic import decided_at_border

MOST_DEADLINES = 8
"""Maximum number of upcoming deadlines that end a separate cell."""


class Cells(Record, eq=False):
    """Partition of the steps after ``now`` into cells, which are ranges of steps.

    Args:
        ends: the last step of each cell, (cells,), ascending; the first cell is one step, and the last ends with the
            mission. Empty if the mission is over.
    """

    now: int
    ends: Indices

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def begins(self) -> Indices:
        """First step of each cell: (cells,)."""
        return np.concatenate(([self.now], self.ends[:-1])) + 1 if len(self.ends) else self.ends

    def of(self, steps: Indices) -> Indices:
        """Index of the cell that contains each step; for a step outside the future, the nearest cell."""
        return np.minimum(np.searchsorted(self.ends, steps), len(self.ends) - 1)


def cells_after(now: int, last: int, deadlines: Iterable[int], spans: Iterable[int]) -> Cells:
    """Cells of the steps after ``now``: their sizes double, and the nearest deadlines end a cell.

    Args:
        last: last step of the mission.
        deadlines: last steps of windows.
        spans: look-ahead, in steps, of windows that are evaluated at every step.
    """
    doubling, size = [], 1
    while now + size < last:
        doubling.append(now + size)
        size *= 2
    nearest = sorted({step for step in deadlines if now < step < last})[:MOST_DEADLINES]
    recurring = sorted({now + span for span in spans if 0 < span < last - now})[:MOST_DEADLINES]
    ends = sorted({*doubling, *nearest, *recurring, *([last] if last > now else [])})
    return Cells(now, np.array(ends, dtype=np.int64))


MOST_MEMBERS = 16
"""Number of members above which a graph's links are bounded in two cells only: the first and the last."""


class AtomBounds:
    """Cached bounds of predicates and links at the present step and in the cells after it."""

    def __init__(self, state: TeamState, cells: Cells) -> None:
        self.state = state
        seconds: Array = np.asarray((cells.ends - cells.now) * float(state.mission.step), dtype=np.float64)
        since_now: Array = np.zeros(1 + len(cells))
        since_now[1:] = seconds
        self.free = Reach(state, since_now, NOW)
        self.coasted = Reach(state, np.maximum(seconds - state.mission.step, 0.0), COASTED)
        self.view = TeamView(state)
        self.predicates: dict[Predicate, Array] = {}
        self.graphs: dict[Graph, Array] = {}

    def of_predicate(self, predicate: Predicate) -> Array:
        """Robustness bounds of a predicate at the present step and in the future cells: (4, rows, 1 + cells),
        metres.
        """
        if predicate not in self.predicates:
            bounds = self._of_flag(predicate.flag) if isinstance(predicate, Flagged) else self._of_margin(predicate)
            self.predicates[predicate] = decided_at_border(bounds, predicate.open_border)
        return self.predicates[predicate]

    def links(self, graph: Graph) -> Array:
        """Robustness bounds of a graph's links at the present step and in future cells: (4, 1 + cells, members,
        members), metres.

        Large graphs have only the first and last cell.
        """
        if graph not in self.graphs:
            members = list(graph.agents)
            margins = all_links(graph, self.state.position)
            pick = self.picked(graph)
            free = _between(self.free.radius[members][:, [0, *(1 + each for each in pick)]])
            coasted = _between(self.coasted.radius[members][:, pick])
            found = np.empty((4, 1 + len(pick), len(members), len(members)))
            found[0], found[1] = margins[NOW] - free, margins[NOW] + free
            found[2:, 0] = found[:2, 0]
            found[2, 1:], found[3, 1:] = margins[COASTED] - coasted, margins[COASTED] + coasted
            self.graphs[graph] = decided_at_border(found, is_open=True)
        return self.graphs[graph]

    def picked(self, graph: Graph) -> list[int]:
        """Indices of the cells in which a graph's links are bounded."""
        cells = self.free.seconds.size - 1
        return list(range(cells)) if len(graph.agents) <= MOST_MEMBERS or cells < 3 else [0, cells - 1]

    def _of_margin(self, predicate: Predicate) -> Array:
        margins = np.atleast_2d(predicate.margin(self.view))
        free, coasted = (np.atleast_2d(predicate.rate(each)) for each in (self.free, self.coasted))
        rows, cells = len(margins), self.free.seconds.size - 1
        free = np.broadcast_to(free, (rows, 1 + cells)).copy()
        coasted = np.broadcast_to(coasted, (rows, cells)).copy()
        if predicate.reads_heading:
            free[:, 0] = np.where(self.state.doubt > 0, np.inf, 0.0)
            free[:, 1:], coasted[:, 1:] = np.inf, np.inf
            coasted[:, :1] = free[:, :1]
        now, then = margins[:, :1], margins[:, 1:]
        return _stacked(now - free, now + free, then - coasted, then + coasted)

    def _of_flag(self, flag: Flag) -> Array:
        sides = []
        for side, sign in ((0, -1.0), (1, 1.0)):
            for reach, column in ((self.free, NOW), (self.coasted, COASTED)):
                place, margin = self.state.position[:, column], self.state.flags[flag][side, :, column, None]
                change = sign * reach.radius
                sets = -signed_distance(np, flag.set_in.shape, place)[:, None] + change
                stays = margin
                if flag.cleared_in is not None and sign < 0:
                    stays = np.minimum(margin, signed_distance(np, flag.cleared_in.shape, place)[:, None] + change)
                has = np.isin(np.arange(len(place)), flag.agents)[:, None]
                later = np.where(has, np.maximum(sets, stays), -np.inf)
                sides.append(np.where(reach.seconds > 0, later, margin))
        return _stacked(sides[0], sides[2], sides[1], sides[3])


def _stacked(least: Array, most: Array, coasted_least: Array, coasted_most: Array) -> Array:
    """Bounds over all continuations and over those with one step of coasting, in one array.

    They agree at the present step.

    Shape: (rows, 1 + cells) twice and (rows, cells) twice -> (4, rows, 1 + cells), metres.
    """
    found = np.empty((4, *least.shape))
    found[0], found[1] = least, most
    found[2:, :, 0] = found[:2, :, 0]
    found[2, :, 1:], found[3, :, 1:] = coasted_least, coasted_most
    return found


def _between(radius: Array) -> Array:
    """Upper bound on the change of each pair's distance, from the distance that each agent may move.

    Shape: (members, columns) -> (columns, members, members), metres.
    """
    change: Array = radius.T[:, :, None] + radius.T[:, None, :]
    itself = np.arange(len(radius))
    change[:, itself, itself] = 0.0
    return change
