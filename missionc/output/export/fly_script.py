"""Values for the templates of scripts and readmes: vehicles, phases of the flight, turns and limits."""

from __future__ import annotations

import math
from dataclasses import asdict

from missionc.geometry.curves.piecewise_polynomials import speed_bounds
from missionc.output.export.takeoff_and_landing import GROUND, peaks, phases, turns_of
from missionc.output.export.verified_flight import Flight
from missionc.verification.flight.verify_whole_flight import LANDED, landing_seconds
from missionc.verification.flight.way_missions import is_whole

NEAR = 0.1
"""Maximum horizontal distance from its first point at which a vehicle may take off, metres."""
CLOCK_ERROR, UPTIME = 2.0**-10, 2**14
"""Error of the firmware's float32 clock in seconds, up to an uptime in seconds.

The current time and the start time are each rounded to a multiple of 2^-10 s below 2^14 s.

Source:
    crazyflie-firmware, crtp_commander_high_level.c (``usecTimestamp() / 1e6``, a ``float``) and planner.c
    (``t - t_begin``).
"""


def for_templates(flight: Flight) -> dict[str, object]:
    """Values that describe a flight, by their names in the templates."""
    return asdict(phases(flight)) | {
        "mission": flight.mission.name,
        "robots": [
            {
                "name": each.robot,
                "agent": each.agent.name,
                "file": each.file,
                # Only the owner of the vehicles knows their addresses.
                "uri": f"radio://0/80/2M/E7E7E7{each.agent.index + 1:04X}",
                "first": each.first,
                "yaw": each.yaw,
                "ground": (each.first[0], each.first[1], GROUND),
            }
            for each in flight.parts
        ],
        "turns": turns_of(flight),
        "whole": bool(flight.ways),
        "in_flight": flight.in_flight,
        "begins": round(flight.before, 3),
        "ends": round(flight.before + float(flight.mission.horizon), 3),
        "land_now": _seconds_to_land(flight),
        "landed": LANDED,
        "near": _near(flight),
        "clock": math.ceil(float(speed_bounds(flight.curves).max()) * CLOCK_ERROR * 1e4) / 10,
        "hours": math.floor(UPTIME / 360) / 10,
    }


def _seconds_to_land(flight: Flight) -> float:
    """Duration of a landing from the maximum altitude of the flight within the maximum sink speed, seconds."""
    return max(landing_seconds(each.agent, height) for each, height in zip(flight.parts, peaks(flight), strict=True))


def _near(flight: Flight) -> float:
    """Maximum horizontal distance of a vehicle from its first point at takeoff, metres.

    For columns that were proved clear, it is the vehicles' tracking error.
    """
    missed = [each.agent.vehicle.tracking for each in flight.parts if each.agent.vehicle.tracking > 0]
    return min([NEAR, *missed]) if is_whole(flight.mission) else NEAR
