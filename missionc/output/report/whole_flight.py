"""A whole flight on the page: its phases on the mission's clock, the ways as lines, and the pads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from missionc.curves.crazyflie_csv import curves_of
from missionc.ir import Mission
from missionc.output.documents.whole_flight_json import phases_on_the_clock
from missionc.verify.certificate import Check
from missionc.verify.flight.verify_whole_flight import pieces_of
from missionc.verify.flight.way_missions import Stage, Ways, is_whole, ways_of
from missionc.world.columns import FLOOR

POINTS = 25
"""For each agent's line."""


def whole_flight(mission: Mission, files: Mapping[str, str], ways: Ways) -> dict[str, Any] | None:
    """What the page draws of it; None where the mission does not come from the floor, or a file cannot be read."""
    flown = pieces_of(mission, files) if is_whole(mission) else None
    parts = [pieces_of(mission, ways[stage]) for stage in Stage if stage in ways]
    if flown is None or isinstance(flown, Check) or any(isinstance(part, Check) for part in parts):
        return None
    size = mission.dimension
    lines = []
    for part in parts:
        assert not isinstance(part, Check)
        curves = curves_of([part[agent.name] for agent in mission.agents], slice(0, size))
        lines.append(np.round(curves.at(np.linspace(0.0, float(curves.times[-1]), POINTS)), 3).tolist())
    hovers = ways_of(mission, flown)[Stage.HOME].end[:, :2].tolist()
    return {
        "phases": [
            {"phase": name, "begin": round(begin, 3), "end": round(end, 3)}
            for name, begin, end in phases_on_the_clock(mission, files, ways)
        ],
        "ways": lines,
        "pads": [[round(x, 3), round(y, 3), *([FLOOR] if size == 3 else [])] for x, y in hovers],
    }
