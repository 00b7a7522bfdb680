"""Forecast of every open goal by the plan that is followed: its robustness if all go on as planned from here.

in   Mission, Kernel, the plan's trace; the team's state at one step after the other
out  the robustness of what was flown so far and the rest of the plan after it, for each goal
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Trace
from missionc.ir import Graph, Mission
from missionc.kernel.nodes import (
    Atom,
    Kernel,
    NeighbourNode,
    Node,
    PathLength,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import postorder
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.live.bounds import of_measure
from missionc.monitoring.live.samples import StepState
from missionc.monitoring.logic import ROBUSTNESS, Values

SHARE, SECONDS = 0.1, 6e-8
"""The share of a core's time that is taken, about and at most; and roughly how long one value of a formula takes."""


class PlanForecast:
    """What was flown, and what is planned after it, as one trace that is judged again and again.

    It is as long as the plan, so its memory and the work of a forecast grow with that: ``every`` says after how many
    steps there is another one, so many that they take about a tenth of a core; one, for missions of a usual size.
    """

    def __init__(self, mission: Mission, kernel: Kernel, plan: Trace) -> None:
        self.mission = mission
        self.formulas = kernel.formulas
        self.trace = Trace(plan.step, plan.position.copy(), plan.velocity.copy(), plan.heading.copy())
        self.margins: dict[int, float] = {}
        spread = Atom | WindowNode | UntilNode | NeighbourNode | ReachNode | RouteNode | PathLength
        count = sum(isinstance(node, spread) for node in postorder(self.formulas))
        work = count * plan.position[:, :, 0].size * SECONDS
        self.every = max(1, math.ceil(work / (SHARE * float(mission.step))))
        self.past = _Past(np.zeros(plan.position.shape[1], dtype=np.int64))
        _Again(mission, self.trace, self.past).values(self.formulas)

    def take(self, state: StepState, opened: Iterable[int]) -> dict[int, float]:
        """The robustness of the goals that are open (by their numbers), from what is known at a step.

        An agent that is missing is taken to be where it is planned to be.
        """
        step, trace = state.step, self.trace
        seen = [agent for agent in range(len(self.mission.agents)) if agent not in state.missing]
        trace.position[seen, step] = state.position[seen]
        trace.velocity[seen, step] = state.velocity[seen]
        trace.heading[seen, step] = state.heading[seen]
        self.past.changed[step] = self.past.number + 1
        if step % self.every == 0 or step == self.mission.steps:
            self.past.number += 1
            wanted = {number: self.formulas[number] for number in opened}
            values = _Again(self.mission, trace, self.past).values(wanted.values())
            self.margins = {number: of_measure(float(values[node][0, 0])) for number, node in wanted.items()}
        else:
            still = set(opened)
            self.margins = {number: margin for number, margin in self.margins.items() if number in still}
        return self.margins


@dataclass(slots=True)
class _Past:
    """What spatial operators came to before: for each, in which forecast, of which values of the members, and what.

    ``number`` is that of the forecast; ``changed`` has the first one for which the trace is another one at a step.
    """

    changed: NDArray[np.int64]
    number: int = 0
    found: dict[Node, tuple[int, list[Values], Values]] = field(default_factory=dict)


class _Again(Evaluation):
    """An evaluation that asks spatial operators at those steps alone where something is other than it was.

    They are pointwise in time, and take most of the time that there is; from one forecast to the next one step is new.
    """

    def __init__(self, mission: Mission, trace: Trace, past: _Past) -> None:
        super().__init__(ROBUSTNESS, mission, trace)
        self.past = past
        self.node: Node | None = None

    def neighbour(self, node: NeighbourNode, body: Values) -> Values:
        self.node = node
        return super().neighbour(node, body)

    def reach(self, node: ReachNode, through: Values, end: Values) -> Values:
        self.node = node
        return super().reach(node, through, end)

    def route(self, node: RouteNode, through: Values, end: Values) -> Values:
        self.node = node
        return super().route(node, through, end)

    def path_length(self, node: PathLength, holds: bool) -> Values:
        self.node = node
        return super().path_length(node, holds)

    def _along(
        self, graph: Graph, below: tuple[Values, ...], outside: Values, measure: Callable[..., Values]
    ) -> Values:
        assert self.node is not None
        members, shape = list(graph.agents), (len(self._agents()), self.steps)
        spread = [np.broadcast_to(value, shape)[members] for value in below]
        if self.node not in self.past.found:
            result = super()._along(graph, below, outside, measure)
        else:
            last, before, found = self.past.found[self.node]
            other = self.past.changed > last
            for now, then in zip(spread, before, strict=True):
                other |= (now != then).any(axis=0)
            result = np.broadcast_to(outside, shape).copy()
            result[members] = found
            for step in np.flatnonzero(other) if members else ():
                piece = slice(int(step), int(step) + 1)
                result[members, piece] = measure(piece, *(value[:, piece].T for value in spread)).T
        self.past.found[self.node] = self.past.number, spread, result[members]
        return result
