"""``simulation.json``: what flights in simulation came to, and where everybody was in the first of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missionc.emit.text import compact, record
from missionc.file_names import SIMULATION_SCHEMA
from missionc.ir import Mission
from missionc.simulation.course import SETPOINTS_PER_SECOND
from missionc.simulation.fly import Flown

EACH = 4
"""Of the samples, every fourth is kept."""
DIGITS = 4
"""After the point: tenths of millimetres."""


def simulation_json(mission: Mission, said: Mapping[str, object], flown: Flown) -> bytes:
    """The same bytes for the same flight.

    Args:
        said: what ``missionc simulate --format json`` says of it.
    """
    position = np.round(flown.position[0, :, ::EACH], DIGITS) + 0.0
    paths = {agent.name: position[agent.index].T.tolist() for agent in mission.agents}
    lines = [f"  {compact(key)}: {compact(value)}" for key, value in {"schema": SIMULATION_SCHEMA, **said}.items()]
    flight = f'{{"samples_per_second": {SETPOINTS_PER_SECOND // EACH}, "agents": {record(paths, depth=1)}}}'
    return ("{\n" + ",\n".join([*lines, f'  "flight": {flight}']) + "\n}\n").encode()
