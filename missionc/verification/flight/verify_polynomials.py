"""Verification of written polynomials: the verified plan in continuous time, and each vehicle's claims.

    in   Mission, the verified Trace, the text of each agent's file
    out  Certificate, with the boxes of its proof

The float32 values of the firmware are verified in continuous time, with a bound on the rounding of the verifier itself.
A vehicle's profile gives a continuous-time claim for every finite limit, and checks of constants. Each claim becomes a
check with the boxes of its proof.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isfinite

import numpy as np

from missionc.base.trace import Array, Indices, Trace
from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, motion, read
from missionc.ir import PLAIN, Agent, Mission, Vehicle
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import CERTAIN, MOTION, ROUNDING, Certificate, Check, Figure
from missionc.verification.flight.continuity_and_fidelity import check_flight, tube
from missionc.verification.flight.joint_claims import Flight, downwash, obstacles, separation, world
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.plan.whole_requirements import check_requirements
from missionc.verification.proof.branch_and_bound import Claim, Judge, branch_and_bound, everyone, of_agents
from missionc.verification.proof.proof_boxes import Boxes, at_most, between_bounds, boxes_of, in_band, upright

GRAVITY = 9.81
"""Gravitational acceleration, m/s², as in the firmware."""

PIECE_BYTES = 132
"""Vehicle memory for one polynomial piece, bytes (crazyflie-firmware, pptraj.c)."""

COMPRESSED_BYTES = {2: 31, 3: 45}
"""Vehicle memory for one piece in the firmware's compressed format, bytes, by the mission's dimension.

A trajectory needs 11 bytes more for its start and end.
"""


def limits(mission: Mission, flight: Flight) -> list[Claim]:
    """Claims that vehicles stay within their limits of speed, acceleration and thrust, one claim for each limited
    quantity.
    """
    acceleration = flight.derived(2)
    thrust = acceleration.moved(np.array([0.0, 0.0, GRAVITY]))
    lengths: tuple[tuple[str, str, str, Enclosed, Callable[[Vehicle], float]], ...] = (
        ("speed", "m/s", "horizontally", flight.derived(1, (0, 1)), lambda vehicle: vehicle.speed),
        ("vertical speed", "m/s", "vertically", flight.derived(1, (2,)), lambda vehicle: vehicle.vertical_speed),
        ("acceleration", "m/s^2", "in any direction", acceleration, lambda vehicle: vehicle.acceleration),
        ("jerk", "m/s^3", "in any direction", flight.derived(3), lambda vehicle: vehicle.jerk),
        ("yaw rate", "rad/s", "about the vertical", flight.derived(1, (3,)), lambda vehicle: vehicle.yaw_rate),
    )
    claims = []
    for name, unit, which, curves, figure in lengths:
        most = np.array([figure(agent.vehicle) for agent in mission.agents])
        chosen = np.flatnonzero(np.isfinite(most))
        judge = at_most(_of_items(flight, most[chosen]))
        claims.append(_claim(flight, name, unit, f"no vehicle exceeds its limit {which}", chosen, curves, judge))
    most = np.array([agent.vehicle.tilt for agent in mission.agents])
    chosen = np.flatnonzero(np.isfinite(most))
    judge = upright(_of_items(flight, most[chosen]))
    detail = "no vehicle exceeds its tilt limit"
    claims.append(_claim(flight, "tilt", "rad", detail, chosen, thrust, judge))
    # A length is never negative: a band from 0 has no lower end.
    low = np.array([agent.vehicle.thrust.low or -np.inf for agent in mission.agents])
    high = np.array([agent.vehicle.thrust.high for agent in mission.agents])
    chosen = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    judge = in_band(_of_items(flight, low[chosen]), _of_items(flight, high[chosen]))
    detail = "the thrust of every vehicle, in multiples of its weight, is in its range"
    claims.append(_claim(flight, "thrust", "g", detail, chosen, thrust.scaled(1 / GRAVITY), judge))
    low = np.array([agent.vehicle.height.low for agent in mission.agents])
    high = np.array([agent.vehicle.height.high for agent in mission.agents])
    chosen = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    judge = between_bounds(_of_items(flight, low[chosen])[:, None], _of_items(flight, high[chosen])[:, None])
    detail = "every vehicle is in its height range"
    claims.append(_claim(flight, "height", "m", detail, chosen, flight.position[:, :, [2]], judge))
    return [claim for claim in claims if claim.items]


def check_memory(mission: Mission, flight: Flight) -> list[Check]:
    """Checks that the pieces of each trajectory fit into the vehicle's memory.

    For a plain agent this is only a warning.
    """
    pieces = flight.durations.size
    raw, compressed = pieces * PIECE_BYTES, pieces * COMPRESSED_BYTES[mission.dimension] + 11
    size = min(raw, compressed)
    return [
        Check(
            "memory",
            agent.name,
            float(agent.vehicle.memory - size),
            "bytes",
            0.0,
            size <= agent.vehicle.memory,
            agents=(agent.name,),
            detail=f"{pieces} pieces need {raw} bytes, {compressed} compressed; the memory has {agent.vehicle.memory}",
        )
        for agent in mission.agents
        if agent.vehicle != PLAIN
    ]


def check_endurance(mission: Mission, flight: Flight) -> list[Check]:
    """Checks of the flight time against each vehicle's battery endurance."""
    seconds = float(flight.durations.sum())
    return [
        Check(
            "endurance",
            agent.name,
            agent.vehicle.endurance - seconds,
            "s",
            0.0,
            seconds <= agent.vehicle.endurance,
            agents=(agent.name,),
            detail=f"the polynomials last {seconds:g} s; the battery endurance is {agent.vehicle.endurance:g} s",
        )
        for agent in mission.agents
        if np.isfinite(agent.vehicle.endurance)
    ]


def _of_items(flight: Flight, figure: Array) -> Array:
    return np.repeat(figure, flight.durations.size)


def _claim(flight: Flight, name: str, unit: str, detail: str, chosen: Indices, curves: Enclosed, judge: Judge) -> Claim:
    return Claim(
        f"flown {name}",
        "vehicles",
        unit,
        MOTION,
        detail,
        chosen[:, None],
        flight.times,
        of_agents(curves[chosen]),
        judge,
        CERTAIN,
    )


MANY = 20_000
"""Number of proof boxes above which the proof aims only at the required margin, if that needs fewer boxes."""


def prove(mission: Mission, claim: Claim) -> tuple[Check, Boxes]:
    """Check and proof boxes of a claim with at least one item; the check's margin is the minimum bound of the boxes."""
    parts = branch_and_bound(claim)
    slack = claim.tolerance + (claim.gap if isfinite(claim.gap) else 0.0)
    if parts.item.size > MANY and parts.lower.min() >= -slack:
        fewer = branch_and_bound(claim, enough=-slack)
        parts = fewer if fewer.item.size < parts.item.size else parts
    boxes = boxes_of(claim, parts)
    subject, piece = divmod(parts.worst, claim.pieces)
    check = Check(
        name=claim.name,
        subject=claim.subject,
        margin=boxes.least,
        unit=claim.unit,
        tolerance=slack,
        # A witness below the tolerance refutes; between witnesses, the proof may be short by the gap.
        passed=boxes.least >= -slack and parts.least >= -claim.tolerance,
        at=claim.when(piece + parts.moment),
        agents=tuple(mission.agents[agent].name for agent in claim.agents[subject].tolist()),
        detail=claim.detail,
    )
    return check, boxes


MEMORY_BYTES = PLAIN.memory
"""Memory of the firmware for all trajectories together, bytes."""

STRONGEST = 12.0
"""Acceleration, m/s², up to which a Crazyflie with a thrust of 1.58 times its weight keeps its altitude.

Source:
    crazyflie-firmware, platform defaults: four motors of 0.1125 N lift 29 g.
"""


@np.errstate(over="ignore", invalid="ignore")
def verify_polynomials(mission: Mission, kernel: Kernel, trace: Trace, files: Mapping[str, str]) -> Certificate:
    """Certificate for the polynomials of each agent and of all agents together, and for the requirements at the steps.

    Args:
        files: text of each agent's trajectory file, by agent name.

    Returns:
        Only the checks that files are readable, if one of them is not.
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
    checks.append(Check("clock", "polynomials", 0.0, "s", 0.0, same, detail="the durations of all files are equal"))
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
    """Check that an agent's trajectory file is readable.

    Args:
        value: the pieces that were read, or a text that describes the error.
    """
    detail = (
        value if isinstance(value, str) else "header, columns, at least two rows, finite numbers, positive durations"
    )
    return Check("file", agent.name, 0.0, "", 0.0, isinstance(value, Pieces), agents=(agent.name,), detail=detail)


def prove_all(mission: Mission, claims: list[Claim], checks: list[Check], boxes: list[Boxes]) -> None:
    """Prove the claims, and append a check for each to ``checks`` and its proof to ``boxes``."""
    for claim in claims:
        check, proof = prove(mission, claim)
        checks.append(check)
        boxes.append(proof)


def check_apart(mission: Mission, flight: Flight, checks: list[Check], boxes: list[Boxes]) -> list[str]:
    """Verify obstacle clearance and separation, append the checks and proofs, and return warnings.

    If a required distance is violated, the minimum safe distance is checked instead, with a warning.
    """
    warnings = []
    wishes, needed = (
        [*obstacles(mission, flight, strict), *separation(mission, flight, strict)] for strict in (True, False)
    )
    for wish, need in zip(wishes, needed, strict=True):
        check, proof = prove(mission, wish)
        if not check.passed:
            less, short = prove(mission, need)
            if less.passed:
                # The bodies stay apart, but closer than in the plan: reported, not hidden.
                together = check.name == "flown separation"
                who = " and ".join(f"`{name}`" for name in check.agents)
                what = "each other" if together else f"`{check.subject}`"
                wanted = mission.separation if together else mission.clearance
                warnings.append(
                    f"in the trajectories, {who} come{'' if together else 's'} "
                    f"within {check.margin + wanted:.3f} m of {what} "
                    f"at {check.at:.2f} s, and the mission requires {wanted:g} m"
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
        f"{who} accelerates at {peak.value:.1f} m/s^2 at {at}, "
        f"above the {STRONGEST:g} m/s^2 of a Crazyflie with standard motors",
    )


def _requirements(mission: Mission, kernel: Kernel, trace: Trace, flight: Flight) -> list[Check]:
    """Checks of the mission's requirements at the steps, with each agent at the position of its polynomial.

    Velocities and headings are those of the plan. A flight from rest has different ones, and its limits are verified
    separately.
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
            detail="evaluated by the monitor on the polynomials at the sample times",
        )
        for check in required
    ]


def _memory(mission: Mission, flight: Flight) -> tuple[str, ...]:
    pieces, most = flight.durations.size, MEMORY_BYTES // PIECE_BYTES
    if pieces <= most or all(agent.vehicle != PLAIN for agent in mission.agents):
        return ()
    return (f"each trajectory has {pieces} pieces, but the memory of a Crazyflie holds {most} at a time",)


def _peak(mission: Mission, flight: Flight, order: int, name: str, unit: str) -> Figure:
    """Largest norm of a derivative over all agents and times, to a hundredth of its unit."""
    agents, pieces = flight.speed.shape
    curve, judge = of_agents(flight.derived(order)), at_most(np.zeros(agents * pieces))
    claim = Claim(name, name, unit, 0.0, "", everyone(agents), flight.times, curve, judge, 1e-2)
    parts = branch_and_bound(claim)
    subject, piece = divmod(parts.worst, pieces)
    agent = mission.agents[subject].name
    return Figure(name, agent, round(-parts.least, 3), unit, round(claim.when(piece + parts.moment), 3), (agent,))
