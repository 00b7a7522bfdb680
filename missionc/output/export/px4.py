"""Export for PX4 with MAVSDK drone shows: a CSV table for each vehicle, in north, east and down.

The mission's x is north and its y is west, as in drone shows. Yaw is in degrees clockwise from north.

Source:
    alireza787b/mavsdk_drone_show, "Control Modes and Coordinate Systems".
"""

from __future__ import annotations

import numpy as np

from missionc.output.export.export_form import Exported, Format
from missionc.output.export.fill_templates import render
from missionc.output.export.samples import RATE, fixed, sampled
from missionc.output.export.verified_flight import Flight

NAME = "px4"
COLUMNS = "idx,t,px,py,pz,vx,vy,vz,ax,ay,az,yaw,mode,ledr,ledg,ledb"
MANEUVERING = 70
"""Mode number in every row, which means "following the trajectory"; the player adds takeoff and landing."""
WHITE = (255, 255, 255)
TO_NED = np.array([1.0, -1.0, -1.0])


def write(flight: Flight) -> Exported:
    """Files ``Drone 1.csv`` and so on, as the player expects, and a readme with the vehicle of each."""
    samples = sampled(flight)
    files = {}
    names = [f"Drone {index + 1}.csv" for index in range(len(flight.parts))]
    for index in range(len(flight.parts)):
        lines = [COLUMNS]
        for row, time in enumerate(samples.times.tolist()):
            state = (samples.position, samples.velocity, samples.acceleration)
            numbers = np.concatenate([part[index, row] * TO_NED for part in state]).tolist()
            yaw = -np.degrees(samples.yaw[index, row]).item()
            words = [str(row), fixed(time), *map(fixed, numbers), fixed(yaw), str(MANEUVERING), *map(str, WHITE)]
            lines.append(",".join(words))
        files[names[index]] = ("\n".join(lines) + "\n").encode()
    robots = [
        {"agent": each.agent.name, "number": index + 1, "file": names[index], "first": each.first}
        for index, each in enumerate(flight.parts)
    ]
    files["README.md"] = render("px4/README.md.j2", mission=flight.mission.name, robots=robots)
    return Exported(files)


FORMAT = Format(NAME, f"NED tables at {RATE} Hz for MAVSDK drone shows", write)
