"""One candidate motion in numbers: its residuals, its smoothness, and the Jacobians of both by its control points."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from missionc.backends.clot.cost_weights import SHORT, longest_step
from missionc.backends.clot.optimise.active_set import Active
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.residuals import Rows, rows
from missionc.base.trace import Array


class Look:
    """A candidate, and all that is amiss with it."""

    def __init__(self, control: Array, costs: Costs, active: Active, system: System) -> None:
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


class System:
    """The normal equations of a mission's motions, with a smoothness that is quadratic in the control points.

    Metres of way count there as their squares over what they are at ``control``, (agents, points, dim), which is the
    quadratic that touches their number there and is nowhere less (iteratively reweighted least squares).
    """

    def __init__(self, costs: Costs, control: Array) -> None:
        self.shape = _, points, dim = control.shape
        self.number = costs.splines.unknowns()
        self.free = self.number >= 0
        self.count = (int(self.number.max(initial=-1)) + 1) * dim
        ways = np.linalg.norm(np.diff(control, axis=1), axis=2)
        self.gram = [
            _gram(costs, bool(second), points, way) for second, way in zip(costs.splines.smooth, ways, strict=True)
        ]
        blocks = []
        for number, gram in zip(self.number, self.gram, strict=True):
            own = np.unique(number[number >= 0])
            part = (number[:, None] == own).astype(float)  # (points, unknowns of the agent)
            blocks.append(sparse.kron(part.T @ gram @ part, np.eye(dim)))
        self.base = sparse.block_diag(blocks, format="csc") if self.count else sparse.csc_matrix((0, 0))

    def smoothness(self, control: Array) -> float:
        """[clot] (2): lengths and bends of all motions, (agents, points, dim), metres; squared and weighed, no unit."""
        return sum(
            0.5 * float(np.einsum("kd,kl,ld->", one, gram, one)) for one, gram in zip(control, self.gram, strict=True)
        )

    def step(self, control: Array, parts: list[Rows], damping: float, penalty: float) -> Array:
        """How to move the control points, (agents, points, dim), metres."""
        pull = self.pull(control)
        matrix = self.base + damping * sparse.identity(self.count, format="csc")
        amiss = [part for part in parts if part.value.size]
        if amiss:
            jacobian, value = self.jacobian(amiss)
            matrix = matrix + penalty * (jacobian.T @ jacobian)
            pull = pull + penalty * (jacobian.T @ value)
        if not self.count:
            return np.zeros(self.shape)
        return self.moved(
            splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(-pull)
        )

    def pull(self, control: Array) -> Array:
        """The gradient of the smoothness by the unknowns, (unknowns,)."""
        pulls = np.stack([gram @ one for gram, one in zip(self.gram, control, strict=True)])[self.free]
        summed = np.zeros((self.count // self.shape[2], self.shape[2]))
        np.add.at(summed, self.number[self.free], pulls)
        return summed.ravel()

    def moved(self, unknowns: Array) -> Array:
        """The unknowns, (unknowns,), as movements of control points, (agents, points, dim), metres."""
        moved = np.zeros(self.shape)
        moved[self.free] = unknowns.reshape(-1, self.shape[2])[self.number[self.free]]
        return moved

    def jacobian(self, parts: list[Rows]) -> tuple[sparse.csr_matrix, Array]:
        """The rows of all groups one below the other, weighed: (rows, unknowns); and their values, (rows,)."""
        dim, done = self.shape[2], 0
        rows, columns, values, sides = [], [], [], []
        for part in parts:
            scale = np.sqrt(part.weight)
            count = len(part.value)
            for argument, gradient in zip(part.arguments, part.gradient, strict=True):
                number = self.number[argument.agent[:, None], argument.first[:, None] + np.arange(3)]  # (rows, 3)
                entry = argument.weight[:, :, None] * gradient[:, None, :] * scale  # (rows, 3, dim)
                nonzero = (number[:, :, None] >= 0) & (entry != 0)
                column = number[:, :, None] * dim + np.arange(dim)
                row = np.broadcast_to(done + np.arange(count)[:, None, None], entry.shape)
                rows.append(row[nonzero])
                columns.append(column[nonzero])
                values.append(entry[nonzero])
            sides.append(part.value * scale)
            done += count
        if not values:
            return sparse.csr_matrix((0, self.count)), np.zeros(0)
        triples = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sparse.csr_matrix(triples, shape=(done, self.count)), np.concatenate(sides)


def _gram(costs: Costs, second: bool, points: int, way: Array) -> Array:
    """The quadratic form of length and bend over an agent's control points; outside the motion it is at rest.

    Args:
        way: metres from each control point to the next, (points - 1,), about which metres are made quadratic.
    """
    used = costs.splines.steps + 1 + second
    if used < 2:
        return np.zeros((points, points))
    first = np.zeros((used - 1, points))
    first[np.arange(used - 1), np.arange(used - 1)] = -1.0
    first[np.arange(used - 1), np.arange(1, used)] = 1.0
    padded = np.concatenate([np.zeros((1, points)), first, np.zeros((1, points))])
    bend = np.diff(padded, axis=0)
    weight = costs.weights.length + costs.weights.metres / np.maximum(
        way[: used - 1], SHORT * longest_step(costs.mission)
    )
    gram: Array = (first.T * weight) @ first + costs.weights.bend * bend.T @ bend
    return gram
