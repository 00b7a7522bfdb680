"""Score of a motion, computed equally for every method: the verifier's verdict, and four values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Trace
from missionc.ir import Mission, Still
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.verify_plan import verify

BODIES = ("obstacle", "separation")


@dataclass(frozen=True)
class Searched:
    """Motion, with the iterations of its search and the joint motions among which it had to choose."""

    trace: Trace
    iterations: int | None
    joint_motions: int | None


@dataclass(frozen=True)
class Score:
    """Score; ``sampled``: the plan holds at the steps; ``solved``: it passes all of ``verify``.

    ``length``: mean path of a robot, m. ``smoothness``: mean \\|v(t + 1) - v(t)\\|, m/s. ``clearance``: the least
    margin of a body to an obstacle or another body between steps too, m.
    """

    sampled: bool
    solved: bool
    length: float
    smoothness: float
    clearance: float
    refused: str


def score(mission: Mission, kernel: Kernel, trace: Trace) -> Score:
    certificate = verify(mission, kernel, trace)
    length, smoothness = shape(trace)
    elsewhere = all(check.passed for check in certificate.checks if check.name not in BODIES)
    return Score(
        sampled=elsewhere and _room_at_steps(mission, trace) >= 0,
        solved=certificate.passed,
        length=length,
        smoothness=smoothness,
        clearance=min(check.margin for check in certificate.checks if check.name in BODIES),
        refused="; ".join(f"{check.name} {check.subject} {check.margin:.3g}" for check in certificate.failures[:3]),
    )


def shape(trace: Trace) -> tuple[float, float]:
    """Length, m, and smoothness, m/s, of ``Score``."""
    moved = np.diff(trace.position, axis=1)
    turned = np.diff(moved, axis=1) / trace.step
    return float(np.linalg.norm(moved, axis=-1).sum(axis=1).mean()), float(np.linalg.norm(turned, axis=-1).mean())


def _room_at_steps(mission: Mission, trace: Trace) -> float:
    """Minimum clearance of bodies at the steps only, metres, to each other and to static obstacles."""
    position = trace.position
    radius = np.array([agent.radius for agent in mission.agents])
    room = [np.inf]
    for obstacle in mission.obstacles:
        assert isinstance(obstacle.motion, Still)
        far = signed_distance(np, obstacle.shape, position) - radius[:, None] - mission.clearance
        room.append(float(far.min()))
    one, other = np.triu_indices(len(radius), 1)
    if one.size:
        apart = np.linalg.norm(position[one] - position[other], axis=-1)
        room.append(float((apart - (radius[one] + radius[other] + mission.separation)[:, None]).min()))
    return min(room)
