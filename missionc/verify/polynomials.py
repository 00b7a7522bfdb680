"""Whether what the Crazyflies will fly is the verified plan: the written text is read back, nothing else is believed.

    in   Mission, the verified Trace, the text of each agent's file
    out  Certificate

All of it is judged on the float32 values the firmware works with, in
continuous time. A degree-7 piece stays in the hull of its control points, so
what holds for those holds for the flight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from missionc.ir import Agent, Mission
from missionc.kernel.nodes import Kernel
from missionc.plan import Array, Trace
from missionc.verify.advance import least
from missionc.verify.certificate import Certificate, Check, Figure
from missionc.verify.columns import Pieces, read
from missionc.verify.curves import Curves, Indices, motion, speed_bounds, values
from missionc.verify.flight import check_flight
from missionc.verify.obstacles import check_obstacles
from missionc.verify.places import check_world
from missionc.verify.requirements import check_requirements
from missionc.verify.separation import check_separation
from missionc.verify.tolerances import ROUNDING

MEMORY_BYTES, PIECE_BYTES = 4096, 132
"""What the firmware has for all trajectories together, and what one piece takes (pptraj.c)."""

STRONGEST = 12.0
"""m/s²: a Crazyflie whose thrust is 1.58 times its weight keeps its height up to this: g * sqrt(1.58**2 - 1).

Source:
    crazyflie-firmware, platform defaults: four motors of 0.1125 N lift 29 g.
"""


def verify_polynomials(mission: Mission, kernel: Kernel, trace: Trace, files: Mapping[str, str]) -> Certificate:
    """Judge the polynomials of every agent, and all of them together; the requirements too, at the steps of the flight.

    Args:
        files: the text of each agent's file, by the agent's name.
    """
    found = {agent.name: read(files.get(agent.name, "")) for agent in mission.agents}
    checks = [_file(agent, found[agent.name]) for agent in mission.agents]
    pieces = [own for own in found.values() if isinstance(own, Pieces)]
    if len(pieces) < len(found):
        return Certificate(mission.name, tuple(checks))
    planned = motion(mission, trace)
    for agent, own in zip(mission.agents, pieces, strict=True):
        checks += check_flight(mission, agent, own, planned)
    same = all(np.array_equal(own.duration, pieces[0].duration) for own in pieces)
    checks.append(Check("clock", "polynomials", 0.0, "s", 0.0, same, detail="all files have the same durations"))
    if not same:
        return Certificate(mission.name, tuple(checks))
    times = np.concatenate([[0.0], np.cumsum(pieces[0].duration)])
    flown = Curves(times, np.stack([own.coefficients[:, :3] for own in pieces]))
    level = Curves(times, flown.coefficients[:, :, : mission.dimension])
    together, warnings = _together(mission, level)
    together += _requirements(mission, kernel, trace, level)
    velocity = flown.derivative()
    figures = (
        _peak(mission, velocity, "peak speed", "m/s"),
        _peak(mission, velocity.derivative(), "peak acceleration", "m/s^2"),
    )
    return Certificate(
        mission.name, (*checks, *together), figures, (*warnings, *_thrust(figures[1]), *_memory(times.size - 1))
    )


def _file(agent: Agent, value: Pieces | str) -> Check:
    detail = value if isinstance(value, str) else "header, columns, at least two rows, finite, durations positive"
    return Check("file", agent.name, 0.0, "", 0.0, isinstance(value, Pieces), agents=(agent.name,), detail=detail)


def _together(mission: Mission, level: Curves) -> tuple[list[Check], list[str]]:
    """World, obstacles and separation along the flight; and where it keeps less than the plan."""
    findings, warnings = [check_world(mission, level, ROUNDING)], []
    for check in (*check_obstacles(mission, level, ROUNDING), *check_separation(mission, level, ROUNDING)):
        asked = mission.separation if check.name == "separation" else mission.clearance
        room = check.margin + asked
        if not check.passed and room >= -check.tolerance:
            # The bodies stay apart, but closer than the plan's do: said, not hidden.
            who = " and ".join(f"`{name}`" for name in check.agents)
            what = "each other" if check.name == "separation" else f"`{check.subject}`"
            warnings.append(
                f"the polynomials bring {who} within {room:.3f} m of {what} "
                f"at {check.at:.2f} s; the mission asks for {asked:g} m"
            )
            check = replace(check, margin=room, passed=True, detail="no bodies touch throughout")
        findings.append(check)
    return [replace(check, name=f"flown {check.name}") for check in findings], warnings


def _requirements(mission: Mission, kernel: Kernel, trace: Trace, level: Curves) -> list[Check]:
    """What the mission asks, with each agent where its polynomials have it at the steps.

    Velocities and headings are the plan's: those of a flight that comes from rest are others, and the limits of a
    flight are judged as such.
    """
    steps = mission.step * np.arange(mission.steps + 1)
    piece = np.clip(np.searchsorted(level.times, steps, side="right") - 1, 0, level.durations.size - 1)
    local = np.clip(steps - level.times[piece], 0.0, level.durations[piece])
    places = values(level.coefficients[:, piece], np.broadcast_to(local, (len(mission.agents), local.size)))
    required, _ = check_requirements(mission, kernel, replace(trace, position=places))
    return [
        replace(
            check,
            name=f"flown {check.name}",
            tolerance=ROUNDING,
            passed=check.passed or check.margin >= -ROUNDING,
            detail="judged by the monitor where the polynomials are at the steps",
        )
        for check in required
    ]


def _thrust(peak: Figure) -> tuple[str, ...]:
    if peak.value <= STRONGEST:
        return ()
    who, at = f"`{peak.subject}`", f"{peak.at:.2f} s"
    return (
        f"{who} accelerates at {peak.value:.1f} m/s^2 at {at}; "
        f"a Crazyflie with its standard motors reaches about {STRONGEST:g} m/s^2",
    )


def _memory(pieces: int) -> tuple[str, ...]:
    most = MEMORY_BYTES // PIECE_BYTES
    if pieces <= most:
        return ()
    return (f"each trajectory has {pieces} pieces; a Crazyflie's memory holds {most} at a time",)


def _peak(mission: Mission, curves: Curves, name: str, unit: str) -> Figure:
    """The largest norm over all agents and times, to a hundredth of its unit."""
    agents, pieces, _, size = curves.coefficients.shape
    flat = curves.coefficients.reshape(agents * pieces, -1, size)

    def margin(item: Indices, local: Array) -> Array:
        return np.asarray(-np.linalg.norm(values(flat[item], local), axis=-1))

    found = least(margin, speed_bounds(curves).ravel(), np.tile(curves.durations, agents), 1e-2)
    item = int(found.upper.argmin())
    at = float(curves.times[item % pieces] + found.at[item])
    agent = mission.agents[item // pieces].name
    return Figure(name, agent, round(-float(found.upper[item]), 3), unit, round(at, 3), (agent,))
