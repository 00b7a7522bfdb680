"""Straight runs of a roadmap of the user's own: lanes that lead straight on, one after the other, at one speed.

    in   Lanes
    out  the numbers of the lanes of each run

Whoever goes on such lanes need not be at a step where one ends and the next begins.
"""

from __future__ import annotations

from collections.abc import Iterator

from missionc.geometry.lane_room import positions
from missionc.ir import Lanes

LONGEST = 8
"""Lanes of a run at most: there are so many runs from each node and no more."""

ASIDE = 1e-9
"""Metres, and the share of a direction, by which a node may be beside the run that it is on: floating rounding."""


def straight_runs(lanes: Lanes) -> list[tuple[int, ...]]:
    """All runs of two lanes to ``LONGEST``, whose speeds are one and none of which has to take some time at least."""
    place = positions(lanes)
    way = [place[lane.target] - place[lane.source] for lane in lanes.lanes]
    leaving: dict[int, list[int]] = {}
    for number, lane in enumerate(lanes.lanes):
        if not lane.duration and lanes.length(lane) > 0:
            leaving.setdefault(lane.source, []).append(number)

    def straight_on(run: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        """The run with each lane more that leads on from it."""
        first, last = lanes.lanes[run[0]], lanes.lanes[run[-1]]
        ahead = place[last.target] - place[first.source]
        ahead = ahead / float((ahead @ ahead) ** 0.5)
        for number in leaving.get(last.target, []):
            along = float(way[number] @ ahead)
            aside = way[number] - along * ahead
            if lanes.lanes[number].speed == first.speed and along > 0 and float((aside @ aside) ** 0.5) <= ASIDE:
                yield (*run, number)

    runs: list[tuple[int, ...]] = []
    latest: list[tuple[int, ...]] = [(number,) for numbers in leaving.values() for number in numbers]
    for _ in range(LONGEST - 1):
        latest = [longer for run in latest for longer in straight_on(run)]
        runs += latest
    return runs
