"""Take-off and landing, outside the polynomials: vehicles rise to their first points and sink from their last.

Nobody verified that part, so it has to be plain: straight up and down, each in
a column of its own.
"""

from __future__ import annotations

import math
from itertools import combinations

from missionc.diagnostics.model import Diagnostic
from missionc.output.export.export_form import refused
from missionc.output.export.verified_flight import Flight, Part
from missionc.verify.tolerances import WAYPOINT

GROUND = 0.0
"""Metres: where the vehicles stand before they take off."""
RISE, SETTLE, GO, SINK = 3.0, 2.0, 4.0, 4.0
"""Seconds: to take off, to hover quietly, to go to the first point, to land."""
LANDED = 0.04
"""Metres: the height to which they sink before their motors stop."""
PHASES = {"rise": RISE, "settle": SETTLE, "go": GO, "sink": SINK, "landed": LANDED}
"""As templates know them."""


def shared_column(name: str, flight: Flight) -> Diagnostic | None:
    """Two vehicles that would take off, or land, through each other."""
    for first, second in combinations(flight.parts, 2):
        need = flight.mission.spacing(first.agent.index, second.agent.index)
        for verb, one, other in (("take off", first.first, second.first), ("land", first.last, second.last)):
            apart = math.dist(one[:2], other[:2])
            # A flight need not end nearer than this to where the plan ends.
            if apart < need - WAYPOINT:
                return _crowded(name, verb, first, second, apart, need)
    return None


def _crowded(name: str, verb: str, first: Part, second: Part, apart: float, need: float) -> Diagnostic:
    where = "starts" if verb == "take off" else "finishes"
    return refused(
        name,
        f"`{first.agent.name}` and `{second.agent.name}` cannot {verb} at once, one above the other",
        f"seen from above they are {apart:.3g} m apart, and need {need:.3g} m",
        help=f"give them {where} that are not above each other; the polynomials alone are in `crazyflie/`",
    )
