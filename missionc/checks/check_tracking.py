"""Check of tracking margins: a vehicle that may fly faster than its profile's margin was measured for says its own.

    says MC731

A flight is proved to keep to its vehicle's limits. As long as these are the
profile's, what `bench/tracking.py` measured at them holds for the flight.
"""

from __future__ import annotations

from missionc.data.vehicles import profiles
from missionc.diagnostics.code import TRACKING_NOT_MEASURED
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import FIGURES, Agent, Mission
from missionc.ir.wording import metres, number
from missionc.resolve.resolve_quantities import SI

LIMITS = ("speed", "vertical_speed", "acceleration", "jerk")
"""Figures of a vehicle that its tracking error grows with."""


def check_tracking(mission: Mission) -> list[Diagnostic]:
    """One finding for each team whose vehicle has a higher limit than its profile, and the profile's margin."""
    teams = {agent.team: agent for agent in reversed(mission.agents)}
    return [finding for agent in reversed(teams.values()) for finding in _beyond(agent)]


def _beyond(agent: Agent) -> list[Diagnostic]:
    own, profile = agent.vehicle, profiles()[agent.vehicle.name]
    raised = [name for name in LIMITS if getattr(own, name) > getattr(profile, name)]
    if not (profile.tracking and raised and own.tracking == profile.tracking):
        return []
    name = raised[0]
    unit = SI[FIGURES[name].dimension]
    return [
        Diagnostic(
            TRACKING_NOT_MEASURED,
            f"`{agent.team}` may fly with {_words(name)} of {number(getattr(own, name))}{unit}; the tracking margin of "
            f"`{profile.name}` was measured up to {number(getattr(profile, name))}{unit}",
            Label(agent.span, f"flown as `{own.name}`"),
            notes=(f"the flight is proved for vehicles within {metres(own.tracking)} of their trajectories",),
            help=f"give `vehicle` its own `tracking` too{_enough(agent)}",
        )
    ]


def _words(name: str) -> str:
    return {"speed": "a speed", "vertical_speed": "a vertical speed", "acceleration": "an acceleration"}.get(
        name, "a jerk"
    )


def _enough(agent: Agent) -> str:
    """The margin that grows as the speed does, where that is what was raised: as measured, it is in proportion."""
    profile = profiles()[agent.vehicle.name]
    times = max(getattr(agent.vehicle, name) / getattr(profile, name) for name in ("speed", "vertical_speed"))
    if times <= 1 or times > 10:
        return ""
    return f": at that speed simulators are off by up to {metres(round(profile.tracking * times, 3))}"
