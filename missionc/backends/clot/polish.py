"""From a candidate that is nearly right to one that is: all agents and steps at once, by Levenberg and Marquardt.

Every shortfall is a row of a sparse least-squares problem, every step solves it exactly. What
has to hold is decided anew at each step by the motion itself, unless a witness decided it.

Source:
    [clot] Problem 1, (4); Nocedal and Wright, "Numerical Optimization", 10.3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from missionc.backends.clot.active import Active
from missionc.backends.clot.costs import Costs
from missionc.backends.clot.demand import Demand
from missionc.backends.clot.residuals import Rows, rows
from missionc.plan import Array

DAMPING = 1e-3
"""Against the length term, to begin with; and its bounds while it adapts."""

LEAST_DAMPING, MOST_DAMPING = 1e-6, 1e4

SETTLED = 1e-2
"""A share of the cost: a step that gains less is one of the last."""

ENOUGH = 0.9
"""A motion is done when no margin lacks more than this share of what it is to have to spare."""

EAGER, PATIENT = 8, 4
"""What has to hold is decided anew at each of the first so many steps, and then at every so many."""

HARDER = 4.0
"""By what shortfalls weigh more where a motion has come to rest with some of them, again and again."""

HARDEST = 256.0
"""By what they weigh more at most."""

LONGEST = 1.0
"""Metres that a control point moves in one step."""


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """Args:
    control: (agents, points, dim), metres.
    shortfall: metres by which the worst margin falls short of nothing to spare; at most 0 where all hold.
    worst: what that margin is about.
    cost: the sum of all costs.
    """

    control: Array
    shortfall: float
    worst: str
    cost: float
    iterations: int


def polish(
    control: Array, costs: Costs, demand: Demand, iterations: int, go_on: Callable[[], bool] = lambda: True
) -> Polished:
    """The motion after at most so many steps; earlier where all margins hold with most of what they are to spare.

    Args:
        control: control points to start from, (agents, points, dim), metres.
    """
    system = _System(costs, control.shape)
    damping, penalty = DAMPING, 1.0
    now = best = _Look(control, costs, demand.active(*costs.splines.states(control)), system)
    done = 0
    while done < iterations and now.total(penalty) > 0 and go_on():
        done += 1
        step = system.step(now.control, now.rows, damping, penalty)
        longest = float(np.linalg.norm(step, axis=-1).max(initial=0.0))
        if longest > LONGEST:
            step *= LONGEST / longest
        ahead = _Look(now.control + step, costs, now.active, system)
        gain = now.total(penalty) - ahead.total(penalty)
        settled = gain <= SETTLED * now.total(penalty)
        if gain > 0:
            damping = max(damping / 4, LEAST_DAMPING)
            now = ahead
            if done < EAGER or done % PATIENT == 0 or settled:
                now = _Look(now.control, costs, demand.active(*costs.splines.states(now.control)), system)
                if now.rank < best.rank:
                    best = now
        else:
            damping = min(damping * 6, MOST_DAMPING)
            settled = damping == MOST_DAMPING
        if settled and now.filled < ENOUGH:
            break
        if settled:
            if penalty >= HARDEST:
                break
            penalty, damping = penalty * HARDER, DAMPING
    return Polished(best.control, best.shortfall, best.worst, best.total(1.0), done)


class _Look:
    """A candidate, and all that is amiss with it."""

    def __init__(self, control: Array, costs: Costs, active: Active, system: _System) -> None:
        self.control, self.active = control, active
        self.rows = [rows(group, control) for group in costs.groups(control, active)]
        self.smoothness = system.smoothness(control)
        self.amiss = sum(0.5 * each.weight * float(each.value @ each.value) for each in self.rows)
        self.shortfall, self.filled, self.worst = -np.inf, 0.0, ""
        for each in self.rows:
            if each.value.size:
                most = float(each.value.max())
                spare = each.spare
                self.filled = max(self.filled, most / spare if spare else np.inf)
                if most - spare > self.shortfall:
                    self.shortfall, self.worst = most - spare, each.name

    def total(self, penalty: float) -> float:
        return self.smoothness + penalty * self.amiss

    @property
    def rank(self) -> tuple[float, float]:
        """The less, the better: what is wrong first, then what it costs."""
        return max(self.shortfall, 0.0), self.total(1.0)


class _System:
    """The normal equations of a mission's motions; the smoothness part of them is the same at each step."""

    def __init__(self, costs: Costs, shape: tuple[int, ...]) -> None:
        agents, points, dim = shape
        free = ~costs.splines.fixed
        self.shape, self.free = shape, free
        number = np.full((agents, points), -1, dtype=np.int64)
        number[free] = np.arange(int(free.sum()))
        self.number = number
        self.count = int(free.sum()) * dim
        self.gram = [_gram(costs, bool(second), points) for second in costs.splines.smooth]
        blocks = [
            sparse.kron(gram[np.ix_(free[agent], free[agent])], np.eye(dim)) for agent, gram in enumerate(self.gram)
        ]
        self.base = sparse.block_diag(blocks, format="csc") if self.count else sparse.csc_matrix((0, 0))

    def smoothness(self, control: Array) -> float:
        """[clot] (2): lengths and bends of all motions."""
        return sum(
            0.5 * float(np.einsum("kd,kl,ld->", one, gram, one)) for one, gram in zip(control, self.gram, strict=True)
        )

    def step(self, control: Array, parts: list[Rows], damping: float, penalty: float) -> Array:
        """How to move the control points, (agents, points, dim), metres."""
        dim = self.shape[2]
        pull = np.stack([gram @ one for gram, one in zip(self.gram, control, strict=True)])[self.free].ravel()
        matrix = self.base + damping * sparse.identity(self.count, format="csc")
        amiss = [part for part in parts if part.value.size]
        if amiss:
            jacobian, value = self._jacobian(amiss)
            matrix = matrix + penalty * (jacobian.T @ jacobian)
            pull = pull + penalty * (jacobian.T @ value)
        moved = np.zeros(self.shape)
        if self.count:
            solved = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(-pull)
            moved[self.free] = solved.reshape(-1, dim)
        return moved

    def _jacobian(self, parts: list[Rows]) -> tuple[sparse.csr_matrix, Array]:
        """The rows of all groups one below the other, weighed: (rows, unknowns); and their values, (rows,)."""
        dim, done = self.shape[2], 0
        rows, columns, values, sides = [], [], [], []
        for part in parts:
            scale = np.sqrt(part.weight)
            count = len(part.value)
            for argument, gradient in zip(part.arguments, part.gradient, strict=True):
                number = self.number[argument.agent[:, None], argument.first[:, None] + np.arange(3)]  # (rows, 3)
                entry = argument.weight[:, :, None] * gradient[:, None, :] * scale  # (rows, 3, dim)
                kept = (number[:, :, None] >= 0) & (entry != 0)
                column = number[:, :, None] * dim + np.arange(dim)
                row = np.broadcast_to(done + np.arange(count)[:, None, None], entry.shape)
                rows.append(row[kept])
                columns.append(column[kept])
                values.append(entry[kept])
            sides.append(part.value * scale)
            done += count
        triples = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sparse.csr_matrix(triples, shape=(done, self.count)), np.concatenate(sides)


def _gram(costs: Costs, second: bool, points: int) -> Array:
    """The quadratic form of length and bend over an agent's control points; outside the motion it is at rest."""
    used = costs.splines.steps + 1 + second
    if used < 2:
        return np.zeros((points, points))
    first = np.zeros((used - 1, points))
    first[np.arange(used - 1), np.arange(used - 1)] = -1.0
    first[np.arange(used - 1), np.arange(1, used)] = 1.0
    padded = np.concatenate([np.zeros((1, points)), first, np.zeros((1, points))])
    bend = np.diff(padded, axis=0)
    gram: Array = costs.weights.length * first.T @ first + costs.weights.bend * bend.T @ bend
    return gram
