"""Summary of flights in a closed loop: what was kept of them, what the ground did, and the room that was left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from missionc.base.figures import counted, decimals
from missionc.closed_loop.fly_loop import LoopFlight
from missionc.closed_loop.ground import Happened
from missionc.ir import Mission
from missionc.simulate.confidence_interval import Fraction, fraction

UNTOUCHED = "nothing touched"


def loop_lines(mission: Mission, flights: Sequence[LoopFlight], replans: bool) -> list[str]:
    """One flight in full; of several, how often each requirement was kept."""
    how = "" if replans else ", nothing planned anew"
    head = f"{mission.name}: {counted(len(flights), 'flight')} of {mission.horizon:g} s in simulation{how}"
    if len(flights) == 1:
        only = flights[0]
        lines = [
            f"{head}: {'everything kept' if only.outcome.satisfied and only.outcome.untouched else 'not all kept'}"
        ]
        lines += [f"  {_said(each)}" for each in only.happened]
        width = max(map(len, only.outcome.requirements), default=0)
        lines += [
            f"  {name:<{width}}  {'kept' if kept else 'lost'}" for name, kept in only.outcome.requirements.items()
        ]
        return [*lines, f"  least room between bodies: {decimals(only.outcome.room)} m"]
    kept = fractions(flights)
    width = max(map(len, kept))
    rows = [
        f"  {name:<{width}}  {each.held} of {each.flights}, in at least {100 * each.low:.1f} % with 95 % confidence"
        for name, each in kept.items()
    ]
    plans = sum(happened.begins is not None for flight in flights for happened in flight.happened)
    return [head, *rows, f"  {counted(plans, 'new plan')}"]


def fractions(flights: Sequence[LoopFlight]) -> dict[str, Fraction]:
    """The fraction of flights that kept each requirement, all of them, and in which nobody touched anything."""
    names = dict.fromkeys(name for flight in flights for name in flight.outcome.requirements)
    held = {name: [flight.outcome.requirements.get(name, True) for flight in flights] for name in names}
    held["all of them"] = [flight.outcome.satisfied for flight in flights]
    held[UNTOUCHED] = [flight.outcome.untouched for flight in flights]
    return {name: fraction(sum(each), len(each)) for name, each in held.items()}


def _said(each: Happened) -> str:
    took = f" in {each.seconds:.2f} s" if each.seconds else ""
    begins = f", begun at {each.begins:g} s" if each.begins is not None else ""
    dropped = f"; given up: {', '.join(f'`{name}`' for name in each.given_up)}" if each.given_up else ""
    return f"{each.time:.1f} s  {each.why}: {each.came}{took}{begins}{dropped}"


def loop_document(mission: Mission, flights: Sequence[LoopFlight], replans: bool) -> dict[str, Any]:
    """The same for programs."""
    return {
        "mission": mission.name,
        "replans": replans,
        "passed": all(flight.outcome.satisfied and flight.outcome.untouched for flight in flights),
        "kept": {
            name: {"held": each.held, "flights": each.flights, "low": each.low, "high": each.high}
            for name, each in fractions(flights).items()
        }
        if flights
        else {},
        "flights": [
            {
                "requirements": dict(flight.outcome.requirements),
                "room": flight.outcome.room if flight.outcome.room < 1e9 else None,
                "lost": list(flight.lost),
                "happened": [
                    {
                        "t": each.time,
                        "why": each.why,
                        "came": each.came,
                        "seconds": round(each.seconds, 3),
                        "begins": each.begins,
                        "given_up": list(each.given_up),
                    }
                    for each in flight.happened
                ],
            }
            for flight in flights
        ],
    }
