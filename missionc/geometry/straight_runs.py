"""Straight runs of a user's roadmap: consecutive lanes in one direction with one speed limit.

    in   Lanes
    out  the indices of the lanes of each run

An agent on such lanes need not be at a node at a step.
"""

from __future__ import annotations

from collections.abc import Iterator

from missionc.geometry.lane_room import positions
from missionc.ir import Lanes

LONGEST = 8
"""Maximum number of lanes of a run, which bounds the number of runs from each node."""

ASIDE = 1e-9
"""Lateral deviation of a node from its run that counts as rounding error, metres."""


def straight_runs(lanes: Lanes) -> list[tuple[int, ...]]:
    """All runs of two to ``LONGEST`` lanes, as lane indices, with one speed limit and without minimum durations."""
    place = positions(lanes)
    way = [place[lane.target] - place[lane.source] for lane in lanes.lanes]
    leaving: dict[int, list[int]] = {}
    for number, lane in enumerate(lanes.lanes):
        if not lane.duration and lanes.length(lane) > 0:
            leaving.setdefault(lane.source, []).append(number)

    def straight_on(run: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        """Yield the run extended by each lane that continues it straight."""
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
