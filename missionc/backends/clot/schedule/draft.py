"""Warm start of an attempt: a schedule, its joint waypoints, and an initial joint trajectory through them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.joint_waypoints import joint_waypoints
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.sketch import sketch
from missionc.backends.clot.schedule.tours import tours
from missionc.backends.clot.schedule.visits import KeyFrame, Schedule
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Mission


class WarmStart(Record, eq=False):
    """Starting point of an attempt: a schedule, its joint waypoints, and a joint trajectory, (agents, steps + 1, dim),
    metres.

    ``number`` is the index of the attempt that made the schedule.
    """

    number: int
    schedule: Schedule
    key: tuple[KeyFrame, ...]
    motion: Array


def draft(
    number: int,
    mission: Mission,
    scheduler: Scheduler,
    geodesics: Geodesics,
    generator: np.random.Generator,
    noise: float,
    go_on: Callable[[], bool],
) -> WarmStart:
    """Warm start from the schedule that a scheduler computes.

    Args:
        number: index of the attempt.
        noise: relative random perturbation of distances.
        go_on: function that returns true while time is left; without time, first guesses are not corrected.
    """
    schedule = scheduler.schedule(noise)
    loose = {agent.index for agent in mission.agents} - scheduler.tied
    toured: dict[int, Array] = {}
    if loose:
        frames, motion = tours(mission, schedule, scheduler.goals, geodesics, generator)
        if not scheduler.tied:
            return WarmStart(number, schedule, frames, motion)
        toured = {agent: motion[agent] for agent in sorted(loose)}
    key = joint_waypoints(mission, schedule, scheduler, geodesics, generator, go_on, toured)
    detours = clot_settings(mission).attempts.detours if noise else 0.0
    first = sketch(mission, schedule, key, geodesics, generator, detours, toured)
    return WarmStart(number, schedule, key, first)
