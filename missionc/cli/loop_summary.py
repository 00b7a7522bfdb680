"""Summary of flights in a closed loop: what was kept of them, what the ground did, and the room that was left."""

from __future__ import annotations

from collections.abc import Sequence

from missionc.base.figures import counted, decimals
from missionc.flight.simulation.trials import shown
from missionc.ir import Mission
from missionc.tools.closed_loop.fly_loop import LoopFlight
from missionc.tools.closed_loop.loop_record import fractions, said


def loop_lines(mission: Mission, flights: Sequence[LoopFlight], replans: bool) -> list[str]:
    """One flight in full; of several, how often each requirement was kept."""
    how = "" if replans else ", nothing planned anew"
    head = f"{mission.name}: {counted(len(flights), 'flight')} of {mission.horizon:g} s in simulation{how}"
    if len(flights) == 1:
        only = flights[0]
        lines = [
            f"{head}: {'everything kept' if only.outcome.satisfied and only.outcome.untouched else 'not all kept'}"
        ]
        lines += [f"  {each.time:.1f} s  {said(each)}" for each in only.happened]
        width = max(map(len, only.outcome.requirements), default=0)
        lines += [
            f"  {name:<{width}}  {'kept' if kept else 'lost'}" for name, kept in only.outcome.requirements.items()
        ]
        return [*lines, f"  least room between bodies: {decimals(only.outcome.room)} m"]
    kept = fractions(flights)
    width = max(map(len, kept))
    rows = [
        f"  {name:<{width}}  {each.held} of {each.flights}, "
        f"at least {shown(each.least)} (one-sided 95 % lower confidence bound)"
        for name, each in kept.items()
    ]
    plans = sum(happened.begins is not None for flight in flights for happened in flight.happened)
    return [head, *rows, f"  {counted(plans, 'new plan')}"]
