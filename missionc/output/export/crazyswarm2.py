"""Export for Crazyswarm2: polynomials, ``crazyflies.yaml``, a script that flies all vehicles, and a readme.

Source:
    IMRCLab/crazyswarm2: crazyflie_py (``Crazyflie``, ``CrazyflieServer``, ``uav_trajectory``), config/crazyflies.yaml.
"""

from __future__ import annotations

from missionc.base.diagnostics.model import Diagnostic
from missionc.output.export.export_form import Exported, Format, refused
from missionc.output.export.fill_templates import render
from missionc.output.export.fly_script import for_templates
from missionc.output.export.takeoff_and_landing import cannot_rise_or_land
from missionc.output.export.trajectory_memory import raw
from missionc.output.export.verified_flight import Flight

NAME = "crazyswarm2"


def write(flight: Flight) -> Exported | Diagnostic:
    """Files of the Crazyswarm2 export, or a diagnostic if a Crazyflie cannot store its polynomials or reach their
    start.
    """
    for each in flight.parts:
        taken, memory = len(raw(each.pieces)), each.agent.vehicle.memory
        if taken > memory:
            return refused(
                NAME,
                f"the polynomials of `{each.agent.name}` need {taken} bytes; the memory has {memory}",
                "Crazyswarm2 uploads raw pieces only",
                help="export with `cflib`, which compresses them",
            )
    grounded = cannot_rise_or_land(NAME, flight)
    if grounded is not None:
        return grounded
    files = {f"trajectories/{each.file}.csv": each.text.encode() for each in flight.parts}
    for name in ("crazyflies.yaml", "fly.py", "README.md"):
        files[name] = render(f"crazyswarm2/{name}.j2", **for_templates(flight))
    return Exported(files)


FORMAT = Format(NAME, "polynomials as CSV, crazyflies.yaml and a start script for Crazyswarm2", write)
