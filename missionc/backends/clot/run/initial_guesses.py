"""Initial guesses of the trajectory optimiser: schedule and initial trajectory of each attempt.

    in   Outline, the index of an attempt
    out  WarmStart

Agents coupled by a formation or by links share joint waypoints; all other agents make tours. Agents on separate tours
may satisfy links by chance. The first attempt uses tours if these satisfy the links and joint waypoints would omit
tasks, such as recurrences. Later attempts use tours occasionally, since local optimisation can close small gaps in
links.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.backends.clot.optimise.control_points import control_after, splines, trace
from missionc.backends.clot.schedule.asked_shapes import reads_links, tied_agents
from missionc.backends.clot.schedule.draft import WarmStart, draft
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.own_state_stops import with_stops
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import Outline
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.walk import postorder
from missionc.verification.monitoring.monitor import monitor


class InitialGuesses(Record, eq=False):
    """Source of initial guesses for the attempts at a mission.

    Args:
        graph: cost graph of the kernel.
        asked: outline of the cost graph.
        in_time: function that returns true while time is left.
        made: called after each initial trajectory.
    """

    mission: Mission
    kernel: Kernel
    graph: Kernel
    asked: Outline
    geodesics: Geodesics
    in_time: Callable[[], bool]
    made: Callable[[], None]

    def begun(self, number: int, drawn: np.random.Generator) -> WarmStart:
        """Warm start of the attempt with index ``number``.

        Args:
            drawn: random generator of the attempt, not used before.
        """
        scheduler = Scheduler(self.mission, self.asked, self.geodesics, drawn)
        left_out = len(scheduler.numbers) < len(self.asked.tasks)
        in_turn = number % clot_settings(self.mission).attempts.tours_every == 1
        turn = (number == 0 and left_out) or (in_turn and bool(self.asked.tasks))
        if turn and scheduler.tied and not tied_agents(self.asked, scheduler.company, links=False):
            (other,) = drawn.spawn(1)
            apart = Scheduler(self.mission, self.asked, self.geodesics, other, links=False)
            begun = self.with_stops(number, apart)
            if number or self.keeps_links(begun.motion):
                return begun
        return self.with_stops(number, scheduler)

    def with_stops(self, number: int, scheduler: Scheduler) -> WarmStart:
        """Warm start from a scheduler, with stops at regions that refill resources or change flags."""
        generator = scheduler.generator
        drawn = generator.bit_generator.state

        def begin(scheduler: Scheduler) -> WarmStart:
            generator.bit_generator.state = drawn
            self.made()
            noise = clot_settings(scheduler.mission).attempts.noise if number else 0.0
            return draft(number, self.mission, scheduler, self.geodesics, generator, noise, self.in_time)

        return with_stops(self.mission, self.graph, scheduler, begin, number, self.in_time)

    def keeps_links(self, motion: Array) -> bool:
        """Return true if a trajectory, (agents, steps + 1, dim), metres, satisfies every requirement about links."""
        made = splines(self.mission)
        sketched = trace(self.mission, made, control_after(self.mission, made, motion))
        verdicts = monitor(self.mission, self.kernel, sketched).requirements
        return all(
            verdict.satisfied
            for wanted, verdict in zip(self.kernel.requirements, verdicts, strict=True)
            if any(map(reads_links, postorder([wanted.formula])))
        )
