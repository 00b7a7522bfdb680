"""Feasibility of one agent's candidates among the agents planned before: every hard constraint, exactly.

Source:
    [clot] IV-D.1: only candidates that satisfy all constraints by the standard semantics enter the tree.
"""

from __future__ import annotations

import math
from itertools import chain

import torch
from torch import Tensor

from missionc.backends.clot.paper.free_distance import Surroundings
from missionc.backends.clot.paper.motion_batch import States, Team, velocities
from missionc.backends.clot.paper.probe_cost import kept_from
from missionc.backends.clot.paper.robustness import Robustness
from missionc.backends.clot.paper.torch_device import places
from missionc.ir import Mission
from missionc.ir.kernel.analysis import about_whom
from missionc.ir.kernel.nodes import Any, Node
from missionc.ir.kernel.walk import postorder


def prefix_margins(
    team: Team,
    agent: int,
    others: tuple[int, ...],
    candidates: Tensor,
    planned: Tensor,
    goals: tuple[Node, ...],
    around: Surroundings,
    as_flown: bool = False,
) -> Tensor:
    """Margins of each candidate: first the least of obstacles, bounds, separation and limits, then each goal.

    Args:
        candidates: (batch, steps, dim), metres.
        others: mission indices of the planned agents; ``planned``: their trajectories, (batch or 1, others, steps,
            dim), metres.
        goals: goals restricted to the planned agents and this agent (``prefix.about``).
        around: obstacles and bounds, with the number of obstacle checks per step.
        as_flown: True to use the accelerations of the spline that an agent with momentum flies from rest to rest
            (``control_points.Splines.through``) instead of the candidate's second differences.

    Returns:
        (1 + goals, batch), metres; speed and acceleration in the metres they move in a step. All are positive if the
        candidate is feasible.

    Source:
        [clot] IV-D.1; II-B for the goals.
    """
    bodies = _body_margin(team.mission, agent, others, candidates, planned, around, as_flown)
    return torch.cat([bodies[None], goal_margins(team, agent, others, candidates, planned, goals)])


def goal_margins(
    team: Team, agent: int, others: tuple[int, ...], candidates: Tensor, planned: Tensor, goals: tuple[Node, ...]
) -> Tensor:
    """Robustness of each goal by the standard semantics: (goals, batch), metres.

    Args:
        candidates: (batch, steps, dim), metres.
        planned: trajectories of ``others``, (batch or 1, others, steps, dim), metres.
    """
    if not goals:
        return candidates.new_zeros(0, len(candidates))
    position = candidates.new_zeros(len(candidates), len(team.mission.agents), *candidates.shape[1:])
    position[:, places(others, candidates.device)] = planned
    position[:, agent] = candidates
    states = States(position, velocities(position, float(team.mission.step)))
    values = Robustness(team, states).values(postorder(goals))
    return torch.stack([values[goal][:, 0, 0].expand(len(candidates)) for goal in goals])


def left_open(choice: Any, known: Any, team: Team, agents: tuple[int, ...], planned: Tensor) -> Any:
    """Disjunction without the parts that are violated whatever other agents do; unchanged if no part would remain.

    Args:
        known: the same parts restricted to the planned agents; or ``choice`` itself if only the parts independent of
            other agents are known. A part that fails in the whole batch is violated.
        agents: mission indices of the planned agents; ``planned``: their trajectories, (batch, agents, steps, dim),
            metres.
    """
    parts, same = _parts(choice), _parts(known)
    if len(parts) != len(same):
        return choice
    decided = list(range(len(same)))
    if known is choice:
        count = len(team.mission.agents)
        others, about = [agent for agent in range(count) if agent not in agents], about_whom(same, count)
        decided = [number for number in decided if not about[same[number]][others, 0].any()]
    decisive = tuple(same[number] for number in decided)
    worth = goal_margins(team, agents[-1], agents[:-1], planned[:, -1], planned[:, :-1], decisive)
    lost = {number for number, holds in zip(decided, (worth > 0.0).any(dim=1).tolist(), strict=True) if not holds}
    return Any(tuple(part for number, part in enumerate(parts) if number not in lost) or parts)


def _parts(choice: Node) -> tuple[Node, ...]:
    """Parts of a disjunction, including those of nested disjunctions."""
    if not isinstance(choice, Any):
        return (choice,)
    return tuple(chain.from_iterable(map(_parts, choice.parts)))


def _body_margin(
    mission: Mission,
    agent: int,
    others: tuple[int, ...],
    candidates: Tensor,
    planned: Tensor,
    around: Surroundings,
    as_flown: bool,
) -> Tensor:
    step, one = float(mission.step), mission.agents[agent]
    parts = around.parts
    share = (torch.arange(parts, device=candidates.device) / parts)[:, None].to(candidates)
    between = candidates[:, :-1, None] * (1 - share) + candidates[:, 1:, None] * share
    fine = torch.cat([between.flatten(1, 2), candidates[:, -1:]], dim=1)
    margin = (
        around.room(fine[:, :, None], torch.arange(fine.shape[1], device=fine.device), one.radius)
        .flatten(1)
        .amin(dim=1)
    )
    moved = candidates.diff(dim=1)
    far = torch.linalg.vector_norm(moved, dim=-1).amax(dim=1)
    margin = torch.minimum(margin, one.dynamics.top_speed * step - far)
    if math.isfinite(one.dynamics.top_acceleration):
        leg = _spline(candidates).diff(dim=1) if as_flown and one.dynamics.has_momentum else moved
        bend = torch.linalg.vector_norm(leg.diff(dim=1), dim=-1).amax(dim=1)
        margin = torch.minimum(margin, one.dynamics.top_acceleration * step * step - bend)
    if others:
        need, factors = kept_from(mission, agent, others, candidates)
        apart = _approach(candidates[:, None], planned, factors[:, None]).amin(dim=-1) - need
        margin = torch.minimum(margin, apart.amin(dim=1))
    return margin


def _spline(candidates: Tensor) -> Tensor:
    """Control points of the splines that an agent flies: (batch, steps, dim), metres -> (batch, steps + 1, dim),
    metres."""
    begin, end = candidates[:, :1], candidates[:, -1:]
    halves = (candidates[:, 1:] + candidates[:, :-1]) / 2
    return torch.cat([begin, begin, halves[:, 1:-1], end, end], dim=1)


def _approach(one: Tensor, other: Tensor, factors: Tensor) -> Tensor:
    """Least distance of two points that move straight within each step.

    Shape: (..., steps, dim) twice, metres -> (..., steps - 1), metres.

    Args:
        factors: factor on each axis of a difference, (..., dim).
    """
    apart = (other - one) * factors
    change = apart.diff(dim=-2)
    apart = apart[..., :-1, :]
    square = (change * change).sum(dim=-1)
    when = (-(apart * change).sum(dim=-1) / square.clamp_min(1e-12)).clamp(0.0, 1.0)
    nearest: Tensor = torch.linalg.vector_norm(apart + change * when[..., None], dim=-1)
    return nearest
