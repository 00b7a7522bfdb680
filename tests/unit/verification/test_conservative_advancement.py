"""Least values with a proof: how far below they may stay, and how many values that takes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from missionc.base.trace import Array, Indices
from missionc.verification.plan import conservative_advancement
from missionc.verification.plan.conservative_advancement import Least, least


def sought(
    *margins: Callable[[Array], Array],
    gap: float = 1e-3,
    ceiling: float | None = None,
    duration: float = 2.0,
    speed: float = 1.0,
) -> tuple[Least, int]:
    """The least values of functions of the seconds that change by ``speed`` each second, and how many were taken."""
    taken = 0

    def margin(item: Indices, local: Array) -> Array:
        nonlocal taken
        taken += item.size
        return np.array([margins[each](second) for each, second in zip(item, local, strict=True)])

    count = len(margins)
    return least(margin, np.full(count, speed), np.full(count, duration), gap, ceiling), taken


def falls(second: Array) -> Array:
    """From 2 down to 0 in two seconds."""
    return 2.0 - second


def turns(second: Array) -> Array:
    """Least after half a second, where it is 0.25."""
    return 0.25 + np.abs(second - 0.5)


def flat(second: Array) -> Array:
    return 5.0 + 0.0 * second


def test_the_bounds_are_as_close_as_they_are_asked_to_be() -> None:
    for gap in (0.5, 1e-2, 1e-4):
        for margin, true in ((falls, 0.0), (turns, 0.25)):
            found, _ = sought(margin, gap=gap)
            lower, upper = float(found.lower[0]), float(found.upper[0])
            assert lower <= true <= upper
            assert upper - lower <= gap + 1e-3 * max(upper, 0.0)
            assert float(margin(found.at)[0]) == upper


def test_one_value_is_enough_where_nothing_changes() -> None:
    found, taken = sought(flat, speed=0.0)
    assert (found.lower.tolist(), found.upper.tolist(), found.at.tolist(), taken) == ([5.0], [5.0], [1.0], 1)


def test_large_values_are_found_to_a_thousandth_of_themselves() -> None:
    coarse, _ = sought(lambda second: 1000.0 + turns(second), gap=1e-6)
    assert 0.25 < coarse.upper[0] - coarse.lower[0] <= 1.001
    _, few = sought(lambda second: 1000.0 + turns(second), gap=1e-6)
    _, many = sought(turns, gap=1e-6)
    assert few < many


def test_only_the_least_of_all_is_sought_where_no_ceiling_is_given() -> None:
    found, taken = sought(falls, flat)
    alone, own = sought(falls)
    assert found.upper[0] == alone.upper[0]
    # The other, which is 4 at least whatever it does, is looked at once.
    assert taken == own + 1
    assert (found.lower[1], found.upper[1]) == (4.0, 5.0)


def test_what_is_above_the_ceiling_is_of_no_interest_and_what_is_below_is_sought_for_each() -> None:
    found, taken = sought(flat, ceiling=3.0)
    assert (found.lower.tolist(), taken) == ([4.0], 1)
    both, _ = sought(turns, lambda second: 1.0 + turns(second), ceiling=9.0)
    assert both.upper.tolist() == pytest.approx([0.25, 1.25], abs=3e-3)
    assert both.lower.tolist() == pytest.approx([0.25, 1.25], abs=3e-3)
    assert (both.lower <= [0.25, 1.25]).all()
    nearer, fewer = sought(turns, lambda second: 1.0 + turns(second), ceiling=0.5)
    assert nearer.lower[1] < both.lower[1]
    assert nearer.lower[1] >= 0.5 - 2e-3
    assert fewer > 0


def test_a_value_that_is_no_number_proves_nothing() -> None:
    with np.errstate(invalid="ignore"):
        found, taken = sought(lambda second: np.nan * second)
    assert (found.lower.tolist(), found.upper.tolist(), taken) == ([-np.inf], [np.inf], 1)


def test_motions_are_looked_at_a_few_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    margins = (falls, turns, flat, lambda second: 0.5 + turns(second))
    whole, taken = sought(*margins, ceiling=9.0)
    for chunk in (1, 2, 3):
        monkeypatch.setattr(conservative_advancement, "CHUNK", chunk)
        found, number = sought(*margins, ceiling=9.0)
        assert found.upper == pytest.approx(whole.upper, abs=2e-3)
        assert found.lower == pytest.approx(whole.lower, abs=2e-3)
        assert (found.lower <= [0.0, 0.25, 5.0, 0.75]).all()
        assert number <= 2 * taken


def test_after_so_many_values_the_bound_stands_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    def found(most: int) -> tuple[float, float, int]:
        monkeypatch.setattr(conservative_advancement, "EVALUATIONS", most)
        bounds, taken = sought(falls)
        return float(bounds.lower[0]), float(bounds.upper[0]), taken

    # The middle of two seconds; then those of its halves, of which the second is lower.
    assert found(0) == (0.0, 1.0, 1)
    assert found(1) == (0.0, 0.5, 3)
    assert found(2) == (0.0, 0.5, 3)


def test_of_several_values_the_smallest_is_kept_with_its_time() -> None:
    upper, at = np.array([1.0, 9.0]), np.zeros(2)
    item, value, when = np.array([0, 1, 1, 1, 0]), np.array([2.0, 5.0, 3.0, 4.0, 1.0]), np.arange(1.0, 6.0)
    conservative_advancement._keep_least(upper, at, item, value, when)
    assert (upper.tolist(), at.tolist()) == ([1.0, 3.0], [0.0, 3.0])
