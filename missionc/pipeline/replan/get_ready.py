"""Readiness: all that planning anew takes is loaded before the clock runs, for a library takes seconds to load."""

from __future__ import annotations

from missionc.backends.load import load_engines, load_repair, load_straighten
from missionc.backends.offers import OFFERS
from missionc.lower.choose_backend import choose_backend
from missionc.pipeline.replan.request import Flying


def get_ready(flying: Flying) -> None:
    """Load the engines that may be asked, what polishes their plans, and what fits and writes flights."""
    choice, _ = choose_backend(flying.checked.valid_mission, None)
    for engine in choice.engines if choice else ():
        load_engines((engine,))
        if engine in OFFERS:
            load_straighten(engine)
    load_repair(flying.trace)
    import missionc.backends.smt.backend
    import missionc.flight.crazyflie
    import missionc.output.output_files  # noqa: F401
