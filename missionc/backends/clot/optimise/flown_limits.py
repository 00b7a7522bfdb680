"""Residuals of vehicle limits: first-order trajectories accelerate, turn and brake as their vehicles can fly.

The residuals only guide the search: a plan is verified against its dynamics, and its flight against the vehicle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from missionc.backends.clot.optimise.control_points import Arguments, Splines
from missionc.backends.clot.optimise.dual_numbers import Values
from missionc.backends.clot.optimise.residuals import Group
from missionc.backends.clot.optimise.task_residuals import norm
from missionc.backends.clot.settings import Spare, Weights
from missionc.base.trace import Array, Indices
from missionc.ir import Mission
from missionc.ir.lower.flyable_steps import step_limits

FLOWN = "flown speed", "flown rest", "flown climb", "flown change", "flown turn"
"""Names of the residuals, one for each limit in ``StepLimits``."""


def flown_limits(mission: Mission, made: Splines, weights: Weights, spare: Spare) -> Iterator[Group]:
    """Yield a residual group for each limit, over all agents with vehicle limits; in metres per step."""
    limits = {agent.index: found for agent in mission.agents if (found := step_limits(agent, made.step)) is not None}
    if not limits or made.steps == 0:
        return
    agents = np.array(sorted(limits))
    table = {name: np.array([getattr(limits[agent], name.split()[1]) for agent in agents.tolist()]) for name in FLOWN}
    ends = np.array([0, made.steps - 1])
    everywhere = np.arange(made.steps)
    yield from _setting_out(mission, made, agents, table, weights, spare)
    for name, moments, reads, value in (
        ("flown speed", everywhere, 1, lambda one: norm(one)),
        ("flown rest", ends[1:], 1, lambda one: norm(one)),
        ("flown climb", everywhere if mission.dimension == 3 else ends[:0], 1, lambda one: abs(one[:, 2])),
        ("flown change", everywhere[:-1], 2, lambda one, two: norm(two - one)),
        ("flown turn", everywhere[:-2], 3, lambda one, two, three: norm(three - 2 * two + one)),
    ):
        yield from _group(name, made, agents, moments, reads, value, table[name], weights, spare)


def _setting_out(
    mission: Mission, made: Splines, agents: Indices, table: dict[str, Array], weights: Weights, spare: Spare
) -> Iterator[Group]:
    """Yield the residual groups of the first step: of agents that start at rest, and of agents in motion.

    Args:
        agents: agents with limits, (some,).
        table: limits in metres per step, by residual name.
    """
    moves = np.array([bool(mission.agents[agent].begins) for agent in agents.tolist()])
    first = np.zeros(1, dtype=np.int64)
    resting, moving = agents[~moves], agents[moves]
    yield from _group(
        "flown rest", made, resting, first, 1, lambda one: norm(one), table["flown rest"][~moves], weights, spare
    )
    if moving.size:
        begins = [mission.agents[agent].begins[1][: mission.dimension] for agent in moving.tolist()]
        velocity = np.array(begins)
        most = table["flown change"][moves]
        yield from _group(
            "flown change", made, moving, first, 1, lambda one: norm(one - velocity), most, weights, spare
        )


def _group(
    name: str,
    made: Splines,
    agents: Indices,
    moments: Indices,
    reads: int,
    value: Callable[..., Values],
    most: Array,
    weights: Weights,
    spare: Spare,
) -> Iterator[Group]:
    if not moments.size:
        return
    agent, moment = np.repeat(agents, moments.size), np.tile(moments, agents.size)
    bound = np.repeat(most, moments.size)
    kept = np.isfinite(bound)
    if not kept.any():
        return
    agent, moment, bound = agent[kept], moment[kept], bound[kept]
    limit = bound * (1 - spare.limits) * made.step
    arguments: Sequence[Arguments] = [made.velocity(agent, moment + ahead) for ahead in range(reads)]

    def excess(*velocities: Values) -> Values:
        return value(*velocities) * made.step - limit

    yield Group(name, tuple(arguments), excess, weights.limits, spare.limits * made.step * float(bound.min()))
