"""Summary of closed-loop flights: satisfied requirements, actions of ground control, and minimum clearances."""

from __future__ import annotations

from collections.abc import Sequence

from missionc.base.trace import counted, decimals
from missionc.cli.flight_summary import ROWS
from missionc.flight.simulation.trials import shown
from missionc.ir import Mission
from missionc.tools.closed_loop.fly_loop import LoopFlight
from missionc.tools.closed_loop.ground import GroundEvent
from missionc.tools.closed_loop.loop_record import as_required, fractions, said


def loop_lines(mission: Mission, flights: Sequence[LoopFlight], replans: bool) -> list[str]:
    """Lines with the verdict, events and requirements of a flight; for several, fractions of satisfaction.

    Args:
        mission: flown mission.
        flights: results of the flights.
        replans: whether ground control replanned.
    """
    passed, plans = sum(map(as_required, flights)), sum(each.begins is not None for each in _events(flights))
    how = f"{mission.horizon:g} s, {counted(plans, 'new plan')}" if replans else f"{mission.horizon:g} s, no replanning"
    if len(flights) == 1:
        outcome = flights[0].outcome
        lines = [f"{mission.name}: 1 simulated flight {'passed' if passed else 'failed'} ({how})"]
        lines += [f"  {each.time:.1f} s  {said(each)}" for each in _events(flights)]
        width = max(map(len, outcome.requirements), default=0)
        lines += [
            f"  {name:<{width}}  {'satisfied' if satisfied else 'violated'}"
            for name, satisfied in outcome.requirements.items()
        ]
        return [*lines, f"  smallest distance between bodies: {decimals(outcome.room)} m"]
    shares = {ROWS.get(name, name): each for name, each in fractions(flights).items()}
    width = max(map(len, shares))
    rows = [
        f"  {name:<{width}}  {each.held} of {each.flights}, "
        f"at least {shown(each.least)} (one-sided 95 % lower confidence bound)"
        for name, each in shares.items()
    ]
    return [f"{mission.name}: {passed} of {len(flights)} simulated flights passed ({how})", *rows]


def _events(flights: Sequence[LoopFlight]) -> list[GroundEvent]:
    return [event for flight in flights for event in flight.happened]
