"""A small flight for live monitoring: its mission, session, and lines of samples."""

from __future__ import annotations

import json

from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.verification.monitoring.live.session import Session

FLIGHT = """mission flight
time  step 1 s, horizon 4 s
world (0, 0) to (6, 6)
region goal = box (4, 4) to (5.5, 5.5)
team drone[2] {
  dynamics single_integrator(speed <= 2 m/s)
  start    line (1, 1) to (2, 1)
}
require there: drone[0]: eventually[0, 4 s] goal
require apart: always[0, 4 s] distance(drone[0], drone[1]) >= 0.5
"""

IN_TOUCH = FLIGHT.replace(
    "require there",
    """graph radio = proximity 3 m
formation pair = distances of drone (0-1: 2 m) tolerance 0.5 m
require touch: drone[0]: always[0, 4 s] (somewhere[hops 1..1 on radio] true)
require near: eventually[0, 4 s] pair
require there""",
)
"""The same with a graph and a formation."""


def session_of(text: str = FLIGHT) -> tuple[Checked, Session]:
    checked, session = driver.live_session(Source("flight.mission", text))
    assert session is not None
    return checked, session


def line(time: float, *places: tuple[float, float]) -> str:
    return json.dumps({"t": time, "agents": {f"drone[{agent}]": place for agent, place in enumerate(places)}})
