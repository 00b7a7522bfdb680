"""Record of closed-loop flights: a JSON document for programs, and the data of the report page.

in   Mission, Scenario, flown LoopFlights
out  values for JSON, and data for the report
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from missionc.base.trace import Array, decimals
from missionc.extension import Mission
from missionc.flight.simulation.trials import TRACKING, Fraction, fraction, shown
from missionc.output.report.loop_tracks import LoopFlights
from missionc.tools.closed_loop.fly_loop import Listen, LoopFlight, nobody
from missionc.tools.closed_loop.ground import GroundEvent, GroundStation
from missionc.tools.closed_loop.scenario import Event, Scenario
from missionc.verification.certificate import Check

UNTOUCHED = "nothing touched"
MOST_SHOWN = 200
"""Maximum number of flights that get a row on the page."""
FAR = 1e9
"""Clearance in metres that means that there is no other body."""


class ToldPositions:
    """Commanded positions, collected during a flight; its ``listen`` is a ``Listen`` function.

    Args:
        then: another listener, called with the same arguments.
    """

    def __init__(self, then: Listen = nobody) -> None:
        self._then = then
        self.times: list[float] = []
        self.places: list[Array] = []

    def listen(self, at: float, position: Array, ground: GroundStation, lines: list[str]) -> None:
        """Record the commanded positions of all agents.

        Args:
            at: time of the flight, s.
            position: (3, agents), metres.
            ground: ground control.
            lines: reports that it received.
        """
        self.times.append(at)
        self.places.append(np.stack([ground.told.wanted(agent, at) for agent in range(position.shape[1])]))
        self._then(at, position, ground, lines)


def without_path(flight: LoopFlight) -> LoopFlight:
    """Copy of a flight without its positions and epochs, since many flights with them would fill the memory."""
    epochs = flight.outcome.epochs[:0]
    nothing = np.zeros((len(flight.position), 0, 3))
    return replace(flight, times=nothing[0, :, 0], position=nothing, outcome=replace(flight.outcome, epochs=epochs))


def fractions(flights: Sequence[LoopFlight]) -> dict[str, Fraction]:
    """Fraction of flights that satisfied each requirement, those that satisfied all, and those without a collision."""
    names = dict.fromkeys(name for flight in flights for name in flight.outcome.requirements)
    held = {name: [flight.outcome.requirements.get(name, True) for flight in flights] for name in names}
    held["all of them"] = [flight.outcome.satisfied for flight in flights]
    held[UNTOUCHED] = [flight.outcome.untouched for flight in flights]
    return {name: fraction(sum(each), len(each)) for name, each in held.items()}


def said(each: GroundEvent) -> str:
    """Sentence that describes a ground-control event, without its time."""
    took = f" in {each.seconds:.2f} s" if each.seconds else ""
    begins = f", starts at {each.begins:g} s" if each.begins is not None else ""
    dropped = f"; dropped: {', '.join(f'`{name}`' for name in each.given_up)}" if each.given_up else ""
    return f"{each.why}: {each.came}{took}{begins}{dropped}"


def loop_document(mission: Mission, scenario: Scenario, flights: Sequence[LoopFlight], replans: bool) -> dict[str, Any]:
    """JSON document of the results.

    Args:
        mission: flown mission.
        scenario: events and disturbances.
        flights: results of the flights.
        replans: whether ground control replanned.
    """
    return {
        "mission": mission.name,
        "replans": replans,
        "passed": all(map(as_required, flights)),
        "events": [_event(each) for each in scenario.events],
        "kept": {
            name: {"held": each.held, "flights": each.flights, "least": each.least, "low": each.low, "high": each.high}
            for name, each in fractions(flights).items()
        }
        if flights
        else {},
        "flights": [
            {
                "requirements": dict(flight.outcome.requirements),
                **_nearest(flight.outcome.nearest),
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


def as_required(flight: LoopFlight) -> bool:
    """Return whether every requirement was satisfied without a collision."""
    return flight.outcome.satisfied and flight.outcome.untouched


def _nearest(check: Check | None) -> dict[str, Any]:
    """Minimum clearance with its time and bodies, as JSON; null without a pair of bodies."""
    if check is None or check.margin > FAR:
        return {"room": None, "nearest": None}
    return {"room": check.margin, "nearest": {"t": check.at, "of": _who(check)}}


def _who(check: Check) -> list[str]:
    return [*check.agents, *([] if check.name == "separation" else [check.subject])]


def _event(event: Event) -> dict[str, Any]:
    what = {"lose": event.lose, "slow": event.slow, "change": event.change}
    return {
        "t": event.at,
        **{kind: text for kind, text in what.items() if text},
        **({"to": event.to} if event.slow else {}),
    }


# ---------------------------------------------------------------------- the page


def loop_flights(
    mission: Mission, scenario: Scenario, flights: Sequence[LoopFlight], told: ToldPositions, replans: bool
) -> LoopFlights:
    """Data for the page: all flights in words and numbers, and the path of the first one.

    Args:
        mission: flown mission.
        scenario: events and disturbances.
        flights: results of the flights.
        told: commanded positions of the first flight.
        replans: whether ground control replanned.
    """
    first = flights[0]
    heard = np.array(told.times)
    lost = {each.lose: each.at for each in reversed(scenario.events) if each.lose in first.lost}
    return LoopFlights(
        record={**_page_record(float(mission.horizon), scenario, flights, replans), "gone": lost},
        headline=_headline(flights),
        times=first.times,
        position=first.position,
        heard=heard,
        told=np.stack(told.places, axis=1),
        allowed=np.array([agent.vehicle.tracking or TRACKING for agent in mission.agents]),
        worlds=tuple((epoch.time, epoch.mission) for epoch in first.outcome.epochs),
        lost=lost,
        nearest=first.outcome.nearest,
    )


def _headline(flights: Sequence[LoopFlight]) -> tuple[str, str]:
    """State and text of the headline: number of passed flights, for several flights with a bound on the success
    rate.
    """
    held = sum(map(as_required, flights))
    if len(flights) == 1:
        return ("holds", "1 simulated flight passed") if held else ("fails", "1 simulated flight failed")
    share = fraction(held, len(flights))
    state = "holds" if held == len(flights) else "steps" if held else "fails"
    bound = f"success rate at least {shown(share.least)} (one-sided 95 % lower confidence bound)"
    return state, f"{held} of {len(flights)} simulated flights passed; {bound}"


def _page_record(seconds: float, scenario: Scenario, flights: Sequence[LoopFlight], replans: bool) -> dict[str, Any]:
    # The first one is drawn; after it come the flights with events.
    order = sorted(range(len(flights)), key=lambda number: (number > 0, as_required(flights[number]), number))
    return {
        "replans": replans,
        "flown": len(flights),
        "through": _through(scenario),
        "kept": [
            {"name": name, "held": each.held, "of": each.flights, "low": each.low, "high": each.high}
            for name, each in fractions(flights).items()
        ],
        "flights": [_page_flight(number, flights[number], scenario, seconds) for number in sorted(order[:MOST_SHOWN])],
    }


def _page_flight(number: int, flight: LoopFlight, scenario: Scenario, seconds: float) -> dict[str, Any]:
    outcome = flight.outcome
    return {
        "number": number + 1,
        "passed": as_required(flight),
        "lost": [name for name, kept in outcome.requirements.items() if not kept],
        "touched": not outcome.untouched,
        "plans": sum(each.begins is not None for each in flight.happened),
        **_nearest(outcome.nearest),
        "told": sorted(_told(flight, scenario, seconds), key=lambda each: float(each["t"])),
    }


def _told(flight: LoopFlight, scenario: Scenario, seconds: float) -> Iterator[dict[str, Any]]:
    """Yield the entries of a flight's log: events, actions of ground control, starts of plans, and minimum clearances.

    Args:
        flight: result of the flight.
        scenario: events and disturbances.
        seconds: end of the flight, s.
    """
    for event in scenario.events:
        if event.at <= seconds:
            yield {"t": event.at, "by": "event", "says": _happens(event)}
    for each in flight.happened:
        yield {"t": each.time, "by": "ground", "says": said(each)}
        if each.begins is not None:
            yield {"t": each.begins, "by": "plan", "says": f"the plan requested at {each.time:g} s starts"}
    nearest = flight.outcome.nearest
    if nearest is not None and nearest.at is not None and nearest.margin < FAR:
        who = " and ".join(_who(nearest))
        yield {"t": nearest.at, "by": "nearest", "says": f"closest approach: {who}, {decimals(nearest.margin)} m"}


def _happens(event: Event) -> str:
    if event.lose:
        return f"{event.lose} is lost: its motors stop"
    if event.slow:
        return f"{event.slow} is limited to {event.to:g} of its top speed"
    return f"the world changes: {' '.join(event.change.split())}"


def _through(scenario: Scenario) -> str:
    """Description of a scenario's wind and report errors in words."""
    said = [
        (scenario.wind, f"wind {scenario.wind:g} m/s"),
        (scenario.gust, f"gusts {scenario.gust:g} m/s"),
        (scenario.noise, f"position noise {scenario.noise:g} m"),
        (scenario.dropped, f"{100 * scenario.dropped:g} % of reports lost"),
        (scenario.late, f"reports up to {scenario.late:g} s late"),
        (scenario.skew, f"clocks up to {scenario.skew:g} s late"),
    ]
    return ", ".join(words for value, words in said if value) or "no disturbances"
