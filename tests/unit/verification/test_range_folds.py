"""Least and greatest values over ranges of columns, however many ranges there are."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.verification.monitoring.live.windows import FEW, over_ranges


@pytest.mark.parametrize("choose", [np.minimum, np.maximum], ids=["least", "greatest"])
@pytest.mark.parametrize("columns", [0, 1, 2, 5, 8, 13])
@pytest.mark.parametrize("few", [True, False])
def test_a_range_is_worth_what_its_columns_are(choose: np.ufunc, columns: int, few: bool) -> None:
    values = np.random.default_rng(columns).permutation(3 * columns).reshape(3, columns).astype(np.float64)
    edges = range(-2, columns + 3)
    ranges = [(begin, end) for begin in edges for end in edges]
    parts = [ranges[at : at + FEW] for at in range(0, len(ranges), FEW)] if few else [ranges]
    nothing = np.inf if choose is np.minimum else -np.inf
    for part in parts:
        begin, end = np.array(part).T
        meant = [
            choose.reduce(values[:, max(low, 0) : max(high + 1, 0)], axis=1, initial=nothing) for low, high in part
        ]
        np.testing.assert_array_equal(over_ranges(choose, values, begin, end), np.stack(meant, axis=1))
