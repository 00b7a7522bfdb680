"""Space-time search: the trajectory of least effort through the cells of a grid, layer by layer of time.

    in   costs of the cells in each layer, first and last cell, longest move
    out  cell in each layer, or None if no trajectory avoids infinite costs

The algorithm is dynamic programming backwards over the layers. The effort of a trajectory is the sum of its squared
moves, in cells, and the costs of the cells that it leaves.

The search on a roadmap (``label_setting``) differs: it expands few of many states, forwards, together with the
residuals of the formulas. On a grid every cell of every layer matters, and there are no formulas.

Source:
    Erdmann and Lozano-Pérez, "On multiple moving objects", 1987.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from missionc.base.trace import Array, Indices

ROUNDING = 1e-9
"""Rounding tolerance, in cells, on the length of the longest move."""


def least_effort(cost: Array, first: tuple[int, ...], last: tuple[int, ...], reach: float) -> Indices | None:
    """Cells, (moves + 1, dim), of the trajectory of least effort and cost between two cells; None if every trajectory
    has infinite cost.

    Of equal trajectories, the one with shorter first moves is returned.

    Args:
        cost: (moves, *cells), cost of leaving a cell by each move; infinite for forbidden cells.
        first: first cell; ``last``: last cell.
        reach: longest move, cells.
    """
    shape, span = cost.shape[1:], int(reach)
    squares = {move: float(np.dot(move, move)) for move in product(range(-span, span + 1), repeat=len(shape))}
    moves = sorted((each for each in squares if math.sqrt(squares[each]) <= reach + ROUNDING), key=squares.__getitem__)
    ahead = np.full(shape, np.inf)
    ahead[last] = 0.0
    chosen = np.zeros(cost.shape, dtype=np.int16)
    for layer in range(len(cost) - 1, -1, -1):
        padded = np.pad(ahead, span, constant_values=np.inf)
        best = np.full(shape, np.inf)
        for number, move in enumerate(moves):
            there = padded[tuple(slice(span + by, span + by + size) for by, size in zip(move, shape, strict=True))]
            effort = there + squares[move]
            better = effort < best
            best[better] = effort[better]
            chosen[layer][better] = number
        ahead = best + cost[layer]
    if not np.isfinite(ahead[first]):
        return None
    cells = [np.array(first)]
    for layer in range(len(cost)):
        cells.append(cells[-1] + np.array(moves[int(chosen[(layer, *cells[-1])])]))
    return np.array(cells)
