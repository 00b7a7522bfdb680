"""Windows and *until* on arrays, against their definitions step by step, in numbers and in truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
import pytest

from missionc.monitoring.logic import ROBUSTNESS, TRUTH, Logic, Values
from missionc.monitoring.temporal_windows import release, since, sliding, sliding_back, until

STEPS = 7
HOLD = np.array([[3.0, 5.0, 2.0, 7.0, 1.0, 6.0, 4.0], [9.0, -1.0, 8.0, 8.5, 7.5, 0.5, 2.5]])
END = np.array([[1.0, 0.0, 6.0, 2.0, 9.0, 3.0, 5.0], [-2.0, 4.0, 0.5, 3.5, -1.0, 8.0, 6.5]])

WINDOWS = [(low, high) for low, high in product(range(9), [*range(9), None]) if high is None or low <= high]
BACK = [(low, high) for low, high in product(range(-9, 0), range(-9, 1)) if low <= high]


def rows(values: Values, rule: Callable[[Sequence[float], int], float]) -> list[list[float]]:
    return [[rule(row, now) for now in range(len(row))] for row in values.tolist()]


def window(now: int, low: int, high: int | None) -> range | None:
    """Its steps; None where it runs past the last one."""
    last = STEPS - 1 if high is None else now + high
    return None if last >= STEPS or now + low > last else range(now + low, last + 1)


@pytest.mark.parametrize(("low", "high"), WINDOWS)
def test_a_window_is_the_best_or_the_worst_of_its_steps(low: int, high: int | None) -> None:
    for choose, best in ((np.minimum, min), (np.maximum, max)):

        def rule(row: Sequence[float], now: int, best: Callable[..., float] = best) -> float:
            steps = window(now, low, high)
            return -7.5 if steps is None else best(row[step] for step in steps)

        found = sliding(choose, HOLD, low, high, -7.5)
        assert found.tolist() == rows(HOLD, rule)


def best_until(hold: Sequence[float], end: Sequence[float], steps: range, now: int) -> float:
    return max(
        (min([end[step], *(hold[each] for each in range(now, step, 1 if step > now else -1))]) for step in steps),
        default=-np.inf,
    )


@pytest.mark.parametrize(("low", "high"), WINDOWS)
def test_until_is_the_best_of_its_ends_with_what_holds_before(low: int, high: int | None) -> None:
    found = until(HOLD, END, low, high, -7.5)
    for row, (hold, end) in enumerate(zip(HOLD.tolist(), END.tolist(), strict=True)):
        for now in range(STEPS):
            steps = window(now, low, high)
            assert found[row, now] == (-7.5 if steps is None else best_until(hold, end, steps, now))
    truth = until(HOLD > 2, END > 2, low, high, np.False_)
    assert truth.dtype == np.bool_
    assert truth.tolist() == ((found > 2) & (found != -7.5)).tolist()


@pytest.mark.parametrize(("low", "high"), BACK)
def test_a_window_that_looks_back_has_the_steps_that_there_are(low: int, high: int) -> None:
    for choose, best, empty in ((np.minimum, min, np.inf), (np.maximum, max, -np.inf)):
        found = sliding_back(choose, HOLD, low, high, empty)

        def rule(row: Sequence[float], now: int, best: Callable[..., float] = best, empty: float = empty) -> float:
            return best((row[step] for step in range(max(now + low, 0), now + high + 1)), default=empty)

        assert found.tolist() == rows(HOLD, rule)


@pytest.mark.parametrize(("low", "high"), BACK)
def test_since_is_until_backwards(low: int, high: int) -> None:
    found = since(HOLD, END, low, high, -np.inf)
    for row, (hold, end) in enumerate(zip(HOLD.tolist(), END.tolist(), strict=True)):
        for now in range(STEPS):
            steps = range(max(now + low, 0), now + high + 1)
            assert found[row, now] == best_until(hold, end, steps, now)


@pytest.mark.parametrize("logic", [ROBUSTNESS, TRUTH], ids=["robustness", "truth"])
def test_release_is_what_until_of_the_opposites_is_not(logic: Logic) -> None:
    hold, end = (HOLD, END) if logic is ROBUSTNESS else (HOLD > 2, END > 2)
    for low, high in BACK:
        expected = logic.negate(since(logic.negate(hold), logic.negate(end), low, high, logic.bottom))
        assert np.array_equal(release(logic, hold, end, low, high), expected)
    for low, high in WINDOWS:
        found = release(logic, hold, end, low, high)
        expected = logic.negate(until(logic.negate(hold), logic.negate(end), low, high, logic.bottom))
        for now in range(STEPS):
            inside = window(now, low, high) is not None
            assert np.array_equal(found[:, now], expected[:, now] if inside else np.full(2, logic.bottom))


def test_what_is_one_row_for_all_is_spread() -> None:
    one = HOLD[:1]
    assert until(one, END, 1, 3, -np.inf)[1].tolist() == until(HOLD[[0, 0]], END, 1, 3, -np.inf)[1].tolist()
    assert since(one, END, -3, -1, -np.inf)[1].tolist() == since(HOLD[[0, 0]], END, -3, -1, -np.inf)[1].tolist()
