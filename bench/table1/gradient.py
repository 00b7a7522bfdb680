"""Gradient descent alone: Adam on smooth robustness, from 16 initial values at once.

The cost is the mission's cost graph with smooth maximum (a mean with larger weights for larger values) and minimum
(soft minimum, β = 10 / m; the worst link of a graph is exact), hinges for bodies at the steps and at three points
between, for speed and the world, and the squared lengths of steps. The initial values are straight from dock to pad,
bent by smooth noise that is equal for all agents. Starts and finishes may move within their boxes. Every 20 iterations
the best candidate is verified as ours are; the first valid one is the plan.

Source:
    Y. Gilpin, V. Kurtz and H. Lin, A smooth robustness measure of STL for symbolic control.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from missionc.backends.acceptance import attempt
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.paper.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.motion_batch import States, team, velocities
from missionc.backends.clot.paper.robustness import Robustness
from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel, WindowNode
from missionc.ir.kernel.walk import postorder
from table1.scene import box, speed, stand, trace

STARTS = 16
ITERATIONS = 1500
BETWEEN = (0.0, 0.25, 0.5, 0.75)
SHARP = 10.0
"""Sharpness of the soft minimum and maximum, 1/m."""
ROOM = 0.03
"""Extra margin of the hinges in metres beyond the mission's."""
LENGTH = 0.02
"""Weight of the squared lengths of steps relative to squared metres of hinges."""


class Smooth(Robustness):
    """Robustness whose maximum and minimum propagate gradients to all operands."""

    def meet(self, parts: Sequence[Tensor]) -> Tensor:
        """Soft minimum of values that broadcast to (batch, agents, steps + 1), metres."""
        return least(torch.stack(torch.broadcast_tensors(*parts), dim=-1)) if parts else super().meet(parts)

    def join(self, parts: Sequence[Tensor]) -> Tensor:
        """Soft maximum of values that broadcast to (batch, agents, steps + 1), metres."""
        return greatest(torch.stack(torch.broadcast_tensors(*parts), dim=-1)) if parts else super().join(parts)

    def window(self, node: WindowNode, body: Tensor) -> Tensor:
        """Soft minimum or maximum over a window: (batch, agents, steps + 1), metres."""
        value = self.spread(body)
        steps = value.shape[-1]
        width = (steps - 1 if node.high is None else node.high) - node.low + 1
        ahead = value[..., node.low :].unfold(-1, width, 1)
        within = least(ahead) if node.every else greatest(ahead)
        return torch.nn.functional.pad(within, (0, steps - within.shape[-1]), value=-UNLIMITED)


def least(values: Tensor) -> Tensor:
    """Soft minimum over the last axis: (..., operands) -> (...), metres."""
    return -torch.logsumexp(-SHARP * values, dim=-1) / SHARP


def greatest(values: Tensor) -> Tensor:
    """Soft maximum over the last axis: (..., operands) -> (...), metres."""
    return (torch.softmax(SHARP * values, dim=-1) * values).sum(dim=-1)


def plan(mission: Mission, kernel: Kernel, seed: int, limit: float) -> Trace | str:
    torch.set_num_threads(1)
    problem = _Problem(mission, kernel)
    position = torch.tensor(problem.guesses(np.random.default_rng(seed)), dtype=torch.float32).requires_grad_()
    descent = torch.optim.Adam([position], lr=0.05)
    for iteration in range(1, ITERATIONS + 1):
        descent.zero_grad()
        broken, length = problem.cost(position)
        (broken + LENGTH * length).sum().backward()
        descent.step()
        with torch.no_grad():
            problem.ends(position)
        if iteration % 20 == 0:
            best = int(broken.argmin())
            made = trace(mission, position[best].detach().double().numpy())
            if attempt(mission, kernel, made).is_plan:
                return made
    return f"{ITERATIONS} iterations led to no plan"


class _Problem:
    def __init__(self, mission: Mission, kernel: Kernel) -> None:
        self.mission, self.team = mission, team(mission)
        self.graph = build(kernel)
        self.dock, self.pad = box(mission.agents[0].start), box(mission.agents[0].finish)
        self.fastest = speed(mission)
        count = len(mission.agents)
        self.first, self.second = torch.triu_indices(count, count, offset=1)
        radius = self.team.radius[:, 0]
        self.apart = radius[self.first] + radius[self.second] + mission.separation

    def guesses(self, generator: np.random.Generator) -> Array:
        """Straight motions with smooth noise, (batch, agents, steps + 1, 2), metres."""
        part = np.linspace(0.0, 1.0, self.mission.steps + 1)
        waves = np.sin(np.pi * np.arange(1, 5)[:, None] * part) / np.arange(1, 5)[:, None]
        guesses = []
        for _ in range(STARTS):
            start = stand(self.mission, self.dock, generator)
            finish = stand(self.mission, self.pad, generator)
            straight = start[:, None] + part[:, None] * (finish - start)[:, None]
            guesses.append(straight + 2.0 * np.einsum("wd,ws->sd", generator.normal(size=(4, 2)), waves))
        return np.stack(guesses)

    def ends(self, position: Tensor) -> None:
        for step, area in ((0, self.dock), (-1, self.pad)):
            for axis in range(2):
                position[:, :, step, axis].clamp_(area.low[axis] + 1e-4, area.high[axis] - 1e-4)

    def cost(self, position: Tensor) -> tuple[Tensor, Tensor]:
        """Violation and squared lengths of steps, (batch,) each.

        Position: (batch, agents, steps + 1, 2), metres.
        """
        mission = self.mission
        judge = Smooth(self.team, States(position, velocities(position, mission.step)))
        values = judge.values(postorder(self.graph.formulas))
        broken = position.new_zeros(len(position))
        for wanted in self.graph.requirements:
            broken = broken + torch.relu(ROOM - values[wanted.formula][:, 0, 0]) ** 2
        moved = position.diff(dim=2)
        for part in BETWEEN:
            where = position[:, :, :-1] + part * moved
            for obstacle in mission.obstacles:
                room = signed_distance(torch, obstacle.shape, where) - self.team.radius - mission.clearance
                broken = broken + (torch.relu(ROOM - room) ** 2).sum(dim=(1, 2))
            between = (where[:, self.first] - where[:, self.second]).square().sum(dim=-1).add(1e-9).sqrt()
            broken = broken + (torch.relu(ROOM + self.apart[:, None] - between) ** 2).sum(dim=(1, 2))
        pace = moved.square().sum(dim=-1).add(1e-9).sqrt() / mission.step
        broken = broken + (torch.relu(pace - 0.98 * self.fastest) ** 2).sum(dim=(1, 2)) * mission.step**2
        for axis in range(2):
            outside = torch.relu(mission.world.low[axis] - position[..., axis])
            outside = outside + torch.relu(position[..., axis] - mission.world.high[axis])
            broken = broken + (outside**2).sum(dim=(1, 2))
        return broken, moved.square().sum(dim=(1, 2, 3))
