"""Least or greatest values over ranges of columns."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.monitoring.live.horizon_cells import Indices

FEW = 4
"""Ranges: so many are looked at one by one."""


def over_ranges(choose: np.ufunc, values: Array, begin: Indices, end: Indices) -> Array:
    """``choose`` over the columns ``begin`` … ``end`` of each range: (…, columns) -> (…, ranges).

    Where a range holds no column it is what changes nothing: ``inf`` of ``minimum``, ``-inf`` of ``maximum``.
    """
    neutral = np.inf if choose is np.minimum else -np.inf
    result = np.full((*values.shape[:-1], len(begin)), neutral)
    begin, end = np.maximum(begin, 0), np.minimum(end, values.shape[-1] - 1)
    some = np.flatnonzero(begin <= end)
    if len(some) <= FEW:
        for each in some:
            result[..., each] = choose.reduce(values[..., begin[each] : end[each] + 1], axis=-1)
        return result
    level = np.zeros(len(begin), dtype=np.int64)
    level[some] = np.log2(end[some] - begin[some] + 1).astype(np.int64)
    doubled, size = values, 1
    for power in range(int(level.max()) + 1):
        mine = some[level[some] == power]
        if len(mine):
            result[..., mine] = choose(doubled[..., begin[mine]], doubled[..., end[mine] - size + 1])
        if doubled.shape[-1] > size:
            doubled = choose(doubled[..., :-size], doubled[..., size:])
        size *= 2
    return result
