"""Forecast of every open goal by the plan that is followed: its robustness if all go on as planned from here.

in   Mission, Kernel, the plan's trace; the team's state at one step after the other
out  the robustness of what was flown so far and the rest of the plan after it, for each goal
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.kernel.nodes import Atom, Kernel, UntilNode, WindowNode
from missionc.kernel.walk import graph_of, postorder
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.live.bounds import of_measure
from missionc.monitoring.live.samples import StepState
from missionc.monitoring.logic import ROBUSTNESS

SHARE, SECONDS = 0.1, 6e-8
"""Of a core's time, no more than about this share; and roughly how long one value of a formula takes."""


class PlanForecast:
    """What was flown, and what is planned after it, as one trace that is judged again and again.

    It is as long as the plan, so its memory and the work of a forecast grow with that: ``every`` says after how many
    steps there is another one, so many that they take about a tenth of a core; one, for missions of a usual size.
    """

    def __init__(self, mission: Mission, kernel: Kernel, plan: Trace) -> None:
        self.mission = mission
        self.formulas = [goal.formula for goal in (*kernel.requirements, *kernel.preferences)]
        self.trace = Trace(plan.step, plan.position.copy(), plan.velocity.copy(), plan.heading.copy())
        self.margins: dict[int, float] = {}
        values = 0
        for node in postorder(self.formulas):
            graph = graph_of(node)
            if graph is not None:
                values += len(graph.agents) ** 2
            elif isinstance(node, Atom | WindowNode | UntilNode):
                values += len(mission.agents)
        work = values * (int(mission.steps) + 1) * SECONDS
        self.every = max(1, math.ceil(work / (SHARE * float(mission.step))))

    def take(self, state: StepState, opened: Iterable[int]) -> dict[int, float]:
        """The robustness of the goals that are open (by their numbers), from what is known at a step.

        An agent that is missing is taken to be where it is planned to be.
        """
        step, trace = state.step, self.trace
        seen = [agent for agent in range(len(self.mission.agents)) if agent not in state.missing]
        trace.position[seen, step] = state.position[seen]
        trace.velocity[seen, step] = state.velocity[seen]
        trace.heading[seen, step] = state.heading[seen]
        if step % self.every == 0 or step == self.mission.steps:
            wanted = {number: self.formulas[number] for number in opened}
            values = Evaluation(ROBUSTNESS, self.mission, trace).values(wanted.values())
            self.margins = {number: of_measure(float(values[node][0, 0])) for number, node in wanted.items()}
        else:
            self.margins = {number: margin for number, margin in self.margins.items() if number in set(opened)}
        return self.margins
