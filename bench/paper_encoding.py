"""[strel]'s own encoding, rendered as its text says, with Z3's Python terms.

One integer for each agent and step, one disjunction over all edges for each
step, labels as disjunctions of states, windows unrolled, routes of distinct
agents listed one by one. Nothing is shared between instances, as the paper's
recursive lambda terms share nothing. Collisions are left out, as there.

Source:
    [strel] Symbolic Encoding of the Planning Problem, Algorithm 2.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import z3

from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.ir import Inside, Mission, Proximity
from missionc.language.margins.predicate_margins import link_margin, of_states

Formula = Callable[[int, int], z3.BoolRef]
"""A formula of an agent at a step."""


class TooSlow(Exception):
    """The limit on building the terms came first."""


@dataclass(frozen=True)
class Measured:
    """``encoding`` is all that was spent, where it was stopped: ``solving`` is absent then."""

    encoding: float
    solving: float | None
    answer: str


class Encoding:
    """Terms over the integers ``x[agent][step]``."""

    def __init__(self, mission: Mission, roadmap: Roadmap, deadline: float) -> None:
        self.mission, self.roadmap, self.deadline = mission, roadmap, deadline
        self.agents, self.steps = len(mission.agents), int(mission.steps)
        self.x = [[z3.Int(f"x_{i}_{t}") for t in range(self.steps + 1)] for i in range(self.agents)]
        graph = mission.graphs[0]
        assert isinstance(graph, Proximity)
        near = link_margin(graph, roadmap.position[:, None, :], roadmap.position[None, :, :]) > 0
        self.linked = np.argwhere(near).tolist()
        self.moves = roadmap.moves.tolist()

    def motion(self) -> Iterator[z3.BoolRef]:
        for agent in range(self.agents):
            x = self.x[agent]
            start = self.roadmap.starts[self.roadmap.agents.index(agent)].tolist()
            yield z3.Or([x[0] == state for state in start])
            for step in range(self.steps):
                self.in_time()
                yield z3.Or([x[step] == state for state in range(len(self.roadmap.position))])
                yield z3.Or([z3.And(x[step] == one, x[step + 1] == other) for one, other in self.moves])

    def label(self, name: str) -> Formula:
        region = next(region for region in self.mission.regions if region.name == name)
        margins = of_states(Inside(region, False), self.mission, 0, self.roadmap.position, self.roadmap.velocity)
        states = np.flatnonzero(np.asarray(margins) >= 0).tolist()
        return lambda agent, step: z3.Or([self.x[agent][step] == state for state in states])

    def drone(self, agent: int, step: int) -> z3.BoolRef:
        return z3.BoolVal(True)

    def link(self, one: int, other: int, step: int) -> z3.BoolRef:
        self.in_time()
        x, y = self.x[one][step], self.x[other][step]
        return z3.Or([z3.And(x == s, y == q) for s, q in self.linked])

    def routes(self, agent: int, shortest: int, longest: int) -> Iterator[tuple[int, ...]]:
        others = [other for other in range(self.agents) if other != agent]
        for length in range(shortest, longest + 1):
            for rest in itertools.permutations(others, length):
                yield (agent, *rest)

    def reach(self, through: Formula, end: Formula, shortest: int, longest: int) -> Formula:
        def formula(agent: int, step: int) -> z3.BoolRef:
            return z3.Or(
                [
                    z3.And(
                        [self.link(one, other, step) for one, other in itertools.pairwise(route)]
                        + [through(each, step) for each in route[:-1]]
                        + [end(route[-1], step)]
                    )
                    for route in self.routes(agent, shortest, longest)
                ]
            )

        return formula

    def escape(self, body: Formula, longest: int) -> Formula:
        def formula(agent: int, step: int) -> z3.BoolRef:
            return z3.Or(
                [
                    z3.And(
                        [self.link(one, other, step) for one, other in itertools.pairwise(route)]
                        + [body(each, step) for each in route]
                    )
                    for route in self.routes(agent, 0, longest)
                ]
            )

        return formula

    def in_time(self) -> None:
        if time.process_time() > self.deadline:
            raise TooSlow


def both(*parts: Formula) -> Formula:
    return lambda agent, step: z3.And([part(agent, step) for part in parts])


def no(body: Formula) -> Formula:
    return lambda agent, step: z3.Not(body(agent, step))


def eventually(low: int, high: int, body: Formula) -> Formula:
    return lambda agent, step: z3.Or([body(agent, step + ahead) for ahead in range(low, high + 1)])


def always(low: int, high: int, body: Formula) -> Formula:
    return lambda agent, step: z3.And([body(agent, step + ahead) for ahead in range(low, high + 1)])


def until(low: int, high: int, hold: Formula, end: Formula) -> Formula:
    return lambda agent, step: z3.Or(
        [
            z3.And([end(agent, step + ahead)] + [hold(agent, step + before) for before in range(ahead)])
            for ahead in range(low, high + 1)
        ]
    )


def requirement(name: str, encoding: Encoding, window: int) -> list[z3.BoolRef]:
    """What the mission of that name requires, its window of so many steps."""
    label, drone = encoding.label, encoding.drone
    match name:
        case "strel_deliver":
            somewhere = encoding.reach(drone, drone, 1, 2)
            return [eventually(0, window, both(label("delivered"), somewhere))(0, 0)]
        case "strel_threat":
            watched = always(1, 3, encoding.reach(drone, no(label("threat")), 0, 2))
            return [eventually(0, window, both(label("threat"), watched))(0, 0)]
        case "strel_escape":
            away = eventually(1, 3, encoding.escape(no(label("threat")), 2))
            return [eventually(0, window, both(label("threat"), away))(0, 0)]
        case "strel_goal":
            return [until(0, window, encoding.reach(drone, label("base"), 0, 2), label("goal"))(0, 0)]
        case "strel_avoid" | "strel_avoid_all":
            linked = eventually(0, window, encoding.reach(drone, label("base"), 1, 2))
            threats = [label(f"threat{number}") for number in (1, 2, 3)]
            avoid = always(0, window, both(*map(no, threats)))
            egos = range(encoding.agents if name == "strel_avoid_all" else 1)
            return [*(linked(agent, 0) for agent in egos), *(avoid(agent, 0) for agent in range(encoding.agents))]
    raise ValueError(name)


def measure(name: str, mission: Mission, roadmap: Roadmap, window: int, limit: float) -> Measured:
    """Seconds of the processor to build the terms, and to solve them, within a limit on both together.

    The processor's seconds, so that nothing else on the machine counts against it.
    """
    begin = time.process_time()
    encoding = Encoding(mission, roadmap, begin + limit)
    solver = z3.Solver()
    try:
        solver.add(*encoding.motion())
        solver.add(*requirement(name, encoding, window))
    except TooSlow:
        return Measured(time.process_time() - begin, None, "stopped while encoding")
    built = time.process_time()
    solver.set("timeout", max(1, round(1000 * (begin + limit - built))))
    answer = str(solver.check())
    solved = time.process_time()
    if answer == "unknown":
        return Measured(solved - begin, None, "stopped while solving")
    return Measured(built - begin, solved - built, answer)
