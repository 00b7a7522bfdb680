"""Pure pursuit: trajectories of agents that turn slowly or cannot wait, as near as possible to given trajectories.

In every step the agent turns towards its next position and moves as far ahead as needed, within its limits. It rounds
corners, turns in place, and circles if it cannot wait. A waiting agent turns towards its next motion. Trajectories
within the dynamics stay unchanged. Obstacles are ignored.

Source:
    Coulter, "Implementation of the pure pursuit path tracking algorithm", 1992.
"""

from __future__ import annotations

import math

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.dynamics import can_wait, turn_in_step
from missionc.ir import Dynamics, Mission


def followed(mission: Mission, position: Array) -> Array:
    """Positions, (agents, steps + 1, dim), metres, in which pursuit replaces the trajectories of agents that turn
    slowly or cannot wait."""
    result = position.copy()
    for agent in mission.agents:
        if not can_wait(agent.dynamics) or math.isfinite(turn_in_step(agent.dynamics, mission.step)):
            result[agent.index] = pursued(agent.dynamics, position[agent.index], mission.step)
    return result


def pursued(dynamics: Dynamics, ahead: Array, step: float) -> Array:
    """First-order trajectory that follows positions at the steps, (steps + 1, dim), metres, within the dynamics."""
    still = 1e-4  # share of its longest step, below which an agent that can wait is at rest
    limit = turn_in_step(dynamics, step)
    shortest, longest = dynamics.lowest_speed * step, dynamics.top_speed * step
    position, facing = ahead.copy(), math.nan
    leaves = _leaves(ahead[:, :2], still * longest)
    for now in range(len(ahead) - 1):
        way = ahead[now + 1] - position[now]
        if math.hypot(way[0], way[1]) > still * longest:
            wanted = math.atan2(way[1], way[0])
            turn = 0.0 if math.isnan(facing) else (wanted - facing + math.pi) % (2 * math.pi) - math.pi
            if abs(turn) <= limit and shortest <= np.linalg.norm(way) <= longest:
                facing, position[now + 1] = wanted, ahead[now + 1]
                continue
            facing = wanted - turn + max(-limit, min(limit, turn))
        elif not math.isnan(facing) and leaves[now] < len(ahead):
            next_way = ahead[leaves[now]] - position[now]
            turn = (math.atan2(next_way[1], next_way[0]) - facing + math.pi) % (2 * math.pi) - math.pi
            facing += max(-limit, min(limit, turn))
        direction = 0.0 if math.isnan(facing) else facing
        along = way[0] * math.cos(direction) + way[1] * math.sin(direction)
        far = max(shortest, min(longest, along if along > still * longest else 0.0))
        move = np.array([far * math.cos(direction), far * math.sin(direction), *way[2:]])
        if len(move) > 2:
            climb = math.sqrt(max(0.0, longest**2 - far**2))
            move[2] = max(-climb, min(climb, move[2]))
        position[now + 1] = position[now] + move
    return position


def _leaves(position: Array, still: float) -> list[int]:
    """For each step, the next step with another position, (steps + 1, 2), metres; past the last step if the position
    stays."""
    leaves = [len(position)] * len(position)
    for now in range(len(position) - 2, -1, -1):
        moves = math.hypot(*(position[now + 1] - position[now])) > still
        leaves[now] = now + 1 if moves else leaves[now + 1]
    return leaves
