"""An export for carts that drive from point to point: `agent,t,x,y`, one line a second."""

import numpy as np

from missionc.extension import Exported, Flight, Format


def write(flight: Flight) -> Exported:
    times = np.arange(0.0, flight.duration + 1e-9, 1.0)
    lines = ["agent,t,x,y"]
    for part, places in zip(flight.parts, flight.curves.at(times), strict=True):
        lines += [f"{part.agent.name},{time:g},{x:.3f},{y:.3f}" for time, (x, y, _) in zip(times, places, strict=True)]
    return Exported({"waypoints.csv": ("\n".join(lines) + "\n").encode()})


FORMAT = Format("waypoints", "points to drive to, one a second", write)
