"""Verification of the written polynomials: they fly the verified plan, in continuous time, as the firmware holds them.

    in   Mission, the verified Trace, the text of each agent's file
    out  Certificate, with the boxes that prove it

All of it is judged on the float32 values the firmware works with, in
continuous time, and no rounding of the judge's own is overlooked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from missionc.base.trace import Trace
from missionc.curves.crazyflie_csv import Pieces, read
from missionc.curves.piecewise_polynomials import Curves, motion
from missionc.ir import PLAIN, Agent, Mission
from missionc.kernel.nodes import Kernel
from missionc.monitoring.monitor import monitor
from missionc.verify.certificate import Certificate, Check, Figure
from missionc.verify.flight.continuity_and_fidelity import check_flight, tube
from missionc.verify.flight.flight_curves import Flight
from missionc.verify.flight.joint_claims import downwash, obstacles, separation, world
from missionc.verify.flight.prove_claim import prove
from missionc.verify.flight.vehicle_claims import PIECE_BYTES, check_endurance, check_memory, limits
from missionc.verify.plan.requirements_at_steps import check_requirements
from missionc.verify.proof.branch_and_bound import branch_and_bound
from missionc.verify.proof.claims import Claim, everyone, of_agents
from missionc.verify.proof.interval_margins import at_most
from missionc.verify.proof.proof_boxes import Boxes
from missionc.verify.tolerances import ROUNDING

MEMORY_BYTES = PLAIN.memory
"""What the firmware has for all trajectories together."""

STRONGEST = 12.0
"""m/s²: a Crazyflie whose thrust is 1.58 times its weight keeps its height up to this: g * sqrt(1.58**2 - 1).

Source:
    crazyflie-firmware, platform defaults: four motors of 0.1125 N lift 29 g.
"""


@np.errstate(over="ignore", invalid="ignore")
def verify_polynomials(mission: Mission, kernel: Kernel, trace: Trace, files: Mapping[str, str]) -> Certificate:
    """Judge the polynomials of every agent, and all of them together; the requirements too, at the steps of the flight.

    Args:
        files: the text of each agent's file, by the agent's name.
    """
    trajectories = {agent.name: read(files.get(agent.name, "")) for agent in mission.agents}
    checks = [check_file(agent, trajectories[agent.name]) for agent in mission.agents]
    pieces = [own for own in trajectories.values() if isinstance(own, Pieces)]
    if len(pieces) < len(trajectories):
        return Certificate(mission.name, tuple(checks))
    planned = motion(mission, trace)
    boxes: list[Boxes] = []
    for agent, own in zip(mission.agents, pieces, strict=True):
        checks += check_flight(mission, agent, own, planned)
        prove_all(mission, [tube(mission, agent, own, planned)], checks, boxes)
    same = all(np.array_equal(own.duration, pieces[0].duration) for own in pieces)
    checks.append(Check("clock", "polynomials", 0.0, "s", 0.0, same, detail="all files have the same durations"))
    if not same:
        return Certificate(mission.name, tuple(checks), boxes=tuple(boxes))
    flight = Flight(pieces[0].duration, np.stack([own.coefficients for own in pieces]))
    prove_all(mission, [world(mission, flight)], checks, boxes)
    warnings = check_apart(mission, flight, checks, boxes)
    prove_all(mission, [*downwash(mission, flight), *limits(mission, flight)], checks, boxes)
    checks += [*check_memory(mission, flight), *check_endurance(mission, flight)]
    checks += _requirements(mission, kernel, trace, flight)
    figures = (
        _peak(mission, flight, 1, "peak speed", "m/s"),
        _peak(mission, flight, 2, "peak acceleration", "m/s^2"),
    )
    warnings += [*_thrust(figures[1]), *_memory(mission, flight)]
    return Certificate(mission.name, tuple(checks), figures, tuple(warnings), boxes=tuple(boxes))


def check_file(agent: Agent, value: Pieces | str) -> Check:
    """That it could be read."""
    detail = value if isinstance(value, str) else "header, columns, at least two rows, finite, durations positive"
    return Check("file", agent.name, 0.0, "", 0.0, isinstance(value, Pieces), agents=(agent.name,), detail=detail)


def prove_all(mission: Mission, claims: list[Claim], checks: list[Check], boxes: list[Boxes]) -> None:
    """Adds the check of each claim, and its boxes."""
    for claim in claims:
        check, proof = prove(mission, claim)
        checks.append(check)
        boxes.append(proof)


def check_apart(mission: Mission, flight: Flight, checks: list[Check], boxes: list[Boxes]) -> list[str]:
    """Obstacles and separation; where the flight keeps less than the mission asks, what it needs, and a warning."""
    warnings = []
    wishes, needed = (
        [*obstacles(mission, flight, strict), *separation(mission, flight, strict)] for strict in (True, False)
    )
    for wish, need in zip(wishes, needed, strict=True):
        check, proof = prove(mission, wish)
        if not check.passed:
            less, short = prove(mission, need)
            if less.passed:
                # The bodies stay apart, but closer than the plan's do: said, not hidden.
                together = check.name == "flown separation"
                who = " and ".join(f"`{name}`" for name in check.agents)
                what = "each other" if together else f"`{check.subject}`"
                wanted = mission.separation if together else mission.clearance
                warnings.append(
                    f"the polynomials bring {who} within {check.margin + wanted:.3f} m of {what} "
                    f"at {check.at:.2f} s; the mission asks for {wanted:g} m"
                )
                check, proof = less, short
        checks.append(check)
        boxes.append(proof)
    return warnings


def _thrust(peak: Figure) -> tuple[str, ...]:
    if peak.value <= STRONGEST:
        return ()
    who, at = f"`{peak.subject}`", f"{peak.at:.2f} s"
    return (
        f"{who} accelerates at {peak.value:.1f} m/s^2 at {at}; "
        f"a Crazyflie with its standard motors reaches about {STRONGEST:g} m/s^2",
    )


def _requirements(mission: Mission, kernel: Kernel, trace: Trace, flight: Flight) -> list[Check]:
    """What the mission asks, with each agent where its polynomials have it at the steps.

    Velocities and headings are the plan's: those of a flight that comes from rest are others, and the limits of a
    flight are judged as such.
    """
    steps = np.asarray(mission.step * np.arange(mission.steps + 1), dtype=np.float64)
    level = Curves(flight.times, flight.coefficients[:, :, : mission.dimension])
    required, _ = check_requirements(mission, monitor(mission, kernel, replace(trace, position=level.at(steps))))
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


def _memory(mission: Mission, flight: Flight) -> tuple[str, ...]:
    pieces, most = flight.durations.size, MEMORY_BYTES // PIECE_BYTES
    if pieces <= most or all(agent.vehicle != PLAIN for agent in mission.agents):
        return ()
    return (f"each trajectory has {pieces} pieces; a Crazyflie's memory holds {most} at a time",)


def _peak(mission: Mission, flight: Flight, order: int, name: str, unit: str) -> Figure:
    """The largest norm of a derivative over all agents and times, to a hundredth of its unit."""
    agents, pieces = flight.speed.shape
    curve, judge = of_agents(flight.derived(order)), at_most(np.zeros(agents * pieces))
    claim = Claim(name, name, unit, 0.0, "", everyone(agents), flight.times, curve, judge, 1e-2)
    parts = branch_and_bound(claim)
    subject, piece = divmod(parts.worst, pieces)
    agent = mission.agents[subject].name
    return Figure(name, agent, round(-parts.least, 3), unit, round(claim.when(piece + parts.moment), 3), (agent,))
