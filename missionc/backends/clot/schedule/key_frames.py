"""Key frames: the positions of all agents at the steps that matter, one configuration at a time.

    in   Schedule
    out  the positions of all agents at some of the steps

A configuration has all that must hold at its step: regions, formations, links, bodies apart.
It is found by moving the one before it as little as the holds allow, from several first
guesses: the team moved as it is, turned, or packed into slots of the region. A team that is to get
into a formation is put where there is room for all of it, and the longest way there is short. A file
that stays one goes behind its leader.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from missionc.backends.clot.cost_weights import Weights, spare
from missionc.backends.clot.optimise.control_points import Splines
from missionc.backends.clot.optimise.goal_terms import Demand
from missionc.backends.clot.optimise.levenberg_marquardt import Polished, polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.schedule.first_guesses import FirstGuesses, Guess
from missionc.backends.clot.schedule.follow_leader import parted
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.key_frame import KeyFrame, Routes
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.visits import Schedule
from missionc.base.trace import Array, Flags
from missionc.ir import Anywhere, Inside, Mission, Proximity
from missionc.kernel.nodes import At, Atom

ITERATIONS = 40
"""Iterations of one guess at one configuration."""

JITTER = 0.02
"""Metres by which a guess is shaken: what is exactly straight, or exactly on top of another, has no way out."""

PITCHES = 0.95, 0.75
"""How far apart relays are put, of what their graph bridges."""


def key_frames(
    mission: Mission,
    schedule: Schedule,
    scheduler: Scheduler,
    geodesics: Geodesics,
    generator: np.random.Generator,
    go_on: Callable[[], bool] = lambda: True,
) -> tuple[KeyFrame, ...]:
    """The key frames of a schedule, in order; the first and the last step are among them.

    Args:
        go_on: once it says no, first guesses are taken as they are.
    """
    return _KeyFrames(mission, schedule, scheduler, geodesics, generator, go_on).all()


class _KeyFrames(FirstGuesses):
    def all(self) -> tuple[KeyFrame, ...]:
        located = sorted({0, *(each.step for each in self.schedule.appointments), *self._released()})
        others = {hold.low for hold in self.schedule.holds if hold.timeless} | {self.steps}
        if any(agent.finish is not None for agent in self.mission.agents):
            located = sorted({*located, self.steps})
        frames: dict[int, KeyFrame] = {}
        before: KeyFrame | None = None
        for step in located:
            frames[step] = before = self._frame(step, self._guesses(step, before))
        for step in sorted(others - set(located)):
            earlier = max(each for each in frames if each < step)
            later = min((each for each in frames if each > step), default=None)
            guess, behind, ahead = frames[earlier].position, Routes(), Routes()
            if later is not None:
                share = (step - earlier) / (later - earlier)
                guess = guess * (1 - share) + frames[later].position * share
                for agent, route in frames[later].routes.items():
                    behind[agent], ahead[agent] = parted(route, share)
                    guess[agent] = behind[agent][-1]
                frames[later] = replace(frames[later], routes=ahead)
            frames[step] = self._frame(step, iter(((guess, behind),)))
        return tuple(frames[step] for step in sorted(frames))

    def _released(self) -> Iterator[int]:
        """The steps up to which teams stay in a formation, or linked, that they came together for."""
        for each in self.schedule.appointments:
            if each.visit.shapes and each.visit.lasts:
                yield min(each.step + each.visit.lasts, self.steps)

    def _frame(self, step: int, guesses: Iterator[Guess]) -> KeyFrame:
        """The first guess that can be made right, or the one that comes nearest."""
        demand = self._demand(step)
        pinned = self._pinned(step)
        costs = Costs(self.mission, self._still(pinned), Weights(), spare(self.mission), step)
        best: tuple[Polished, Routes] | None = None
        for polished, routes in self._tries(step, guesses, costs, demand):
            if best is None or polished.shortfall < best[0].shortfall:
                best = polished, routes
            if best[0].shortfall <= 0 or not self.go_on():
                break
        assert best is not None
        polished, routes = best
        return KeyFrame(step, polished.control[:, 0], polished.shortfall, polished.worst, routes)

    def _tries(
        self, step: int, guesses: Iterator[Guess], costs: Costs, demand: Demand
    ) -> Iterator[tuple[Polished, Routes]]:
        """What becomes of each guess; then of it, and of what it became, with relays along the links asked for."""
        for guess, routes in guesses:
            polished = self._polished(step, guess, costs, demand)
            yield polished, routes
            for each in (guess, polished.control[:, 0]):
                for relayed in self._relayed(step, each, demand):
                    yield self._polished(step, relayed, costs, demand), {}

    def _polished(self, step: int, guess: Array, costs: Costs, demand: Demand) -> Polished:
        shaken = guess + JITTER * self.generator.uniform(-1, 1, guess.shape)
        for agent, point in self._exact(step).items():
            shaken[agent] = point
        control = np.repeat(shaken[:, None, :], costs.splines.points, axis=1)
        return polish(control, costs, demand, ITERATIONS, self.go_on)

    # --------------------------------------------------------- what is asked

    def _demand(self, step: int) -> Demand:
        """Everything that holds at a step, and the places of starts and finishes that are regions."""
        here = [hold for hold in self.schedule.holds if hold.timeless and hold.low <= step <= hold.high]
        roots = [At(hold.agent, hold.node) for hold in here]
        for agent in self.mission.agents:
            place = agent.start if step == 0 else agent.finish if step == self.steps else None
            if isinstance(place, Anywhere):
                roots.append(At(agent.index, Atom(Inside(place.region, False))))
        choices = {
            (each.node, each.agent, 0): each.part for each in self.schedule.decisions if each.low <= step <= each.high
        }
        return Demand.of(self.mission, tuple(roots), choices, 0)

    def _still(self, pinned: Flags) -> Splines:
        fixed = np.ones((len(pinned), 3), dtype=np.bool_)
        fixed[:, 0] = pinned
        return Splines(0, float(self.mission.step), np.zeros(len(pinned), dtype=np.bool_), fixed)

    # --------------------------------------------------------------- guesses

    def _relayed(self, step: int, guess: Array, demand: Demand) -> Iterator[Array]:
        """Where links are asked for that are too long: agents whom no place is asked of, evenly along them."""
        active = demand.active(guess[:, None], np.zeros_like(guess)[:, None])
        busy = self._busy(step)
        for pitch in PITCHES:
            relayed = guess.copy()
            for graph, lists in active.joined.items():
                if not isinstance(graph, Proximity):
                    continue
                ends = np.unique(np.concatenate(lists)[:, :2], axis=0)
                lacking = (np.linalg.norm(np.diff(guess[ends], axis=1)[:, 0], axis=-1) / (pitch * graph.radius)).astype(
                    int
                )
                free = [agent for agent in graph.agents if agent not in busy.union(ends[lacking > 0].ravel().tolist())]
                for (one, other), count in zip(ends.tolist(), lacking.tolist(), strict=True):
                    slots = min(count, len(free))
                    share = np.arange(1, slots + 1)[:, None] / (slots + 1)
                    between = guess[one] + share * (guess[other] - guess[one])
                    slot, chosen = linear_sum_assignment(cdist(between, guess[free], "sqeuclidean"))
                    taken = [free[number] for number in chosen]
                    relayed[taken] = between[slot]
                    free = [agent for agent in free if agent not in taken]
            if not np.array_equal(relayed, guess):
                yield relayed
