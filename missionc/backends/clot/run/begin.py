"""Beginnings of attempts: a schedule, its key frames and a first joint motion.

    in   Outline, the number of an attempt
    out  Begun

Who is tied to others, by a formation or by links, is put into key frames with them; everybody else makes a tour.
Links may also be kept by those who go each on a tour of their own. Where tours do keep them the first attempt begins
with those, and others do now and then, as the polish draws together what is nearly linked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from missionc.backends.clot.optimise.control_points import pinned, splines, trace
from missionc.backends.clot.optimise.pursuit import followed
from missionc.backends.clot.run.search_results import Begun
from missionc.backends.clot.schedule.asked_shapes import reads_links
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.key_frames import key_frames
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.sketch import sketch
from missionc.backends.clot.schedule.tasks import Outline
from missionc.backends.clot.schedule.tours import tours
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.kernel.walk import postorder
from missionc.monitoring.monitor import monitor

NOISE = 0.4
"""How differently distances are judged for every schedule but the first."""

DETOUR = 0.3
"""How likely a team goes another way than the shortest, in every attempt but the first."""

APART_EVERY = 3
"""Attempts of which the second one begins with tours, whether they keep the links or not."""


@dataclass(frozen=True, slots=True, eq=False)
class Beginnings:
    """What attempts at a mission begin with.

    Args:
        asked: the outline of the kernel's cost graph.
        in_time: whether to go on.
    """

    mission: Mission
    kernel: Kernel
    asked: Outline
    geodesics: Geodesics
    in_time: Callable[[], bool]

    def begun(self, number: int, drawn: np.random.Generator) -> Begun:
        """The beginning of the attempt of a number; the generator is that of the attempt, unused."""
        noise = NOISE if number else 0.0
        scheduler = Scheduler(self.mission, self.asked, self.geodesics, drawn)
        if not scheduler.tied:
            return self.on_tours(number, scheduler, noise, drawn)
        if scheduler.by_links_alone and self.asked.tasks and (number == 0 or number % APART_EVERY == 1):
            (other,) = drawn.spawn(1)
            apart = Scheduler(self.mission, self.asked, self.geodesics, other, links=False)
            begun = self.on_tours(number, apart, noise, other)
            if number or self.keeps_links(begun.motion):
                return begun
        return self.in_frames(number, scheduler, noise, drawn)

    def on_tours(self, number: int, scheduler: Scheduler, noise: float, drawn: np.random.Generator) -> Begun:
        """Everybody on a tour."""
        schedule = scheduler.schedule(noise)
        frames, motion = tours(self.mission, schedule, scheduler.goals, self.geodesics, drawn)
        return Begun(number, schedule, frames, motion)

    def in_frames(self, number: int, scheduler: Scheduler, noise: float, drawn: np.random.Generator) -> Begun:
        """Those who are tied in key frames, and the others on tours."""
        mission, geodesics = self.mission, self.geodesics
        schedule = scheduler.schedule(noise)
        toured: dict[int, Array] = {}
        if loose := {agent.index for agent in mission.agents} - scheduler.tied:
            _, motion = tours(mission, schedule, scheduler.goals, geodesics, drawn)
            toured = {agent: motion[agent] for agent in sorted(loose)}
        key = key_frames(mission, schedule, scheduler, geodesics, drawn, self.in_time, toured)
        motion = sketch(mission, schedule, key, geodesics, drawn, DETOUR if number else 0.0, toured)
        return Begun(number, schedule, key, motion)

    def keeps_links(self, motion: Array) -> bool:
        """Whether a motion, (agents, steps + 1, dim), metres, keeps every requirement that asks for links."""
        made = splines(self.mission)
        control = pinned(self.mission, made, made.through(followed(self.mission, motion)))
        verdicts = monitor(self.mission, self.kernel, trace(self.mission, made, control)).requirements
        return all(
            verdict.satisfied
            for wanted, verdict in zip(self.kernel.requirements, verdicts, strict=True)
            if any(map(reads_links, postorder([wanted.formula])))
        )
