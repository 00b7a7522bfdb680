"""Evaluation of one candidate trajectory: residuals, smoothness, and their Jacobians by the control points."""

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
    """Evaluated candidate with all its violations."""

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

    def rank(self, enough: float) -> tuple[float, float, float]:
        """Sort key, smaller is better: violation, then shortfall of target margins beyond the fraction ``enough``, then
        cost."""
        return max(self.shortfall, 0.0), max(self.filled - enough, 0.0), self.total(1.0)


class System:
    """Normal equations of a mission's trajectories, with a smoothness term that is quadratic in the control points.

    Path lengths count as their squares divided by their values at ``control``, (agents, points, dim). This quadratic
    function touches the length there and is nowhere below it (iteratively reweighted least squares).
    """

    def __init__(self, costs: Costs, control: Array) -> None:
        self.shape = _, _, dim = control.shape
        self.number = costs.splines.unknowns()
        self.free = self.number >= 0
        self.count = (int(self.number.max(initial=-1)) + 1) * dim
        self.bands = _bands(costs, np.linalg.norm(np.diff(control, axis=1), axis=2))
        rows, columns, values = [], [], []
        for apart, band in enumerate(self.bands):
            one, other = self.number[:, : self.shape[1] - apart], self.number[:, apart:]
            both = (one >= 0) & (other >= 0)
            sides = [(one[both], other[both]), (other[both], one[both])][: 1 + (apart > 0)]
            for row, column in sides:
                rows.append((row[:, None] * dim + np.arange(dim)).ravel())
                columns.append((column[:, None] * dim + np.arange(dim)).ravel())
                values.append(np.repeat(band[both], dim))
        triples = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        self.base = sparse.csc_matrix(triples, shape=(self.count, self.count))

    def smoothness(self, control: Array) -> float:
        """Smoothness cost, [clot] (2): weighted squared lengths and bends of all trajectories, (agents, points, dim),
        metres; dimensionless."""
        return 0.5 * float(np.vdot(control, self._slope(control)))

    def step(self, control: Array, parts: list[Rows], damping: float, penalty: float) -> Array:
        """Damped Gauss-Newton step of the control points, (agents, points, dim), metres."""
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
        """Gradient of the smoothness cost by the unknowns, (unknowns,), per metre."""
        summed = np.zeros((self.count // self.shape[2], self.shape[2]))
        np.add.at(summed, self.number[self.free], self._slope(control)[self.free])
        return summed.ravel()

    def _slope(self, control: Array) -> Array:
        """Gradient of the smoothness cost by all control points, (agents, points, dim), per metre."""
        slope = self.bands[0][:, :, None] * control
        for apart, band in enumerate(self.bands[1:], start=1):
            slope[:, :-apart] += band[:, :, None] * control[:, apart:]
            slope[:, apart:] += band[:, :, None] * control[:, :-apart]
        return slope

    def moved(self, unknowns: Array) -> Array:
        """Displacements of control points, (agents, points, dim), metres, from the displacements of the unknowns,
        (unknowns,)."""
        moved = np.zeros(self.shape)
        moved[self.free] = unknowns.reshape(-1, self.shape[2])[self.number[self.free]]
        return moved

    def jacobian(self, parts: list[Rows]) -> tuple[sparse.csr_matrix, Array]:
        """Weighted Jacobian of all groups' rows, (rows, unknowns), and their weighted values, (rows,), metres."""
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


def _bands(costs: Costs, ways: Array) -> tuple[Array, Array, Array]:
    """Quadratic forms of length and bend over each agent's control points, as bands of the matrix: main, first and
    second diagonal.

    Outside its trajectory an agent is at rest: its first and last bends are those of starting and stopping.

    Args:
        ways: distances between control points, (agents, points - 1), metres, at which lengths are made quadratic.

    Returns:
        (agents, points), (agents, points - 1) and (agents, points - 2): entries of symmetric matrices.
    """
    used = costs.splines.steps + 1 + costs.splines.smooth[:, None]
    point = np.arange(ways.shape[1] + 1)
    after, before = (point < used - 1).astype(float), ((point > 0) & (point < used)).astype(float)
    here = -(after + before)
    weights = costs.weights
    metres = weights.metres / np.maximum(ways, SHORT * longest_step(costs.mission))
    length = after[:, :-1] * (weights.length + metres)
    own, next_one = weights.bend * here**2, weights.bend * (here * after)[:, :-1]
    own[:, 1:] += weights.bend * after[:, :-1] ** 2 + length
    own[:, :-1] += weights.bend * before[:, 1:] ** 2 + length
    next_one += weights.bend * (before * here)[:, 1:] - length
    return own, next_one, weights.bend * before[:, 1:-1] * after[:, 1:-1]
