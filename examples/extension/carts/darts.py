"""A backend that guesses: each agent drives straight to a random place and waits there, until a guess verifies."""

import time

import numpy as np

from missionc.extension import (
    BackendExtension,
    Budget,
    Feature,
    Kernel,
    Mission,
    NotFound,
    Options,
    Outcome,
    Planned,
    Reason,
    Report,
    Trace,
    verify,
)

GUESSES = 2000


class Darts(BackendExtension):
    name = "darts"
    features = frozenset({Feature.EXTENSION_PREDICATE})

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        starts = [agent.start.point for agent in mission.agents if agent.start.point is not None]
        if len(starts) < len(mission.agents):
            return NotFound(Reason.SOLVER, "`darts` needs an exact start of every agent", Report())
        generator = np.random.default_rng(budget.seed)
        for _ in range(GUESSES):
            if time.monotonic() >= budget.deadline:
                return NotFound(Reason.TIME, Reason.TIME.value, Report())
            trace = _guess(mission, np.array(starts), generator)
            if verify(mission, kernel, trace).passed:
                return Planned(trace, Report())
        return NotFound(Reason.SOLVER, f"none of {GUESSES} guesses is a plan", Report())


def _guess(mission: Mission, starts: np.ndarray, generator: np.random.Generator) -> Trace:
    ends = generator.uniform(mission.world.low, mission.world.high, starts.shape)
    speeds = np.array([agent.dynamics.top_speed for agent in mission.agents])
    steps = np.ceil(np.linalg.norm(ends - starts, axis=1) / (speeds * mission.step)).clip(1)  # of each agent's drive
    share = np.minimum(np.arange(mission.steps + 1) / steps[:, None], 1.0)[..., None]
    position = starts[:, None] * (1 - share) + ends[:, None] * share
    velocity = np.zeros_like(position)
    velocity[:, :-1] = np.diff(position, axis=1) / mission.step
    velocity[:, -1] = velocity[:, -2]
    return Trace(mission.step, position, velocity, np.zeros(position.shape[:2]))


BACKEND = Darts()
