"""Windows and *until* on arrays, against their definitions step by step, in numbers and in truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product

import numpy as np
import pytest

from missionc.verification.monitoring.evaluate import release, since, sliding, sliding_back, until
from missionc.verification.monitoring.logic import ROBUSTNESS, TRUTH, Logic, Values

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


def best_ahead(best: Callable[..., float], low: int, high: int | None, row: Sequence[float], now: int) -> float:
    """Its best value in the window that begins now."""
    steps = window(now, low, high)
    return -7.5 if steps is None else best(row[step] for step in steps)


def best_behind(best: Callable[..., float], low: int, high: int, empty: float, row: Sequence[float], now: int) -> float:
    """Its best value in the window that looks back from now."""
    return best((row[step] for step in range(max(now + low, 0), now + high + 1)), default=empty)


def test_a_window_is_the_best_or_the_worst_of_its_steps(subtests: pytest.Subtests) -> None:
    for low, high in WINDOWS:
        with subtests.test(low=low, high=high):
            for choose, best in ((np.minimum, min), (np.maximum, max)):
                found = sliding(choose, HOLD, low, high, -7.5)
                assert found.tolist() == rows(HOLD, partial(best_ahead, best, low, high))


def best_until(hold: Sequence[float], end: Sequence[float], steps: range, now: int) -> float:
    return max(
        (min([end[step], *(hold[each] for each in range(now, step, 1 if step > now else -1))]) for step in steps),
        default=-np.inf,
    )


def test_until_is_the_best_of_its_ends_with_what_holds_before(subtests: pytest.Subtests) -> None:
    for low, high in WINDOWS:
        with subtests.test(low=low, high=high):
            found = until(HOLD, END, low, high, -7.5)
            for row, (hold, end) in enumerate(zip(HOLD.tolist(), END.tolist(), strict=True)):
                for now in range(STEPS):
                    steps = window(now, low, high)
                    assert found[row, now] == (-7.5 if steps is None else best_until(hold, end, steps, now))
            truth = until(HOLD > 2, END > 2, low, high, np.False_)
            assert truth.dtype == np.bool_
            assert truth.tolist() == ((found > 2) & (found != -7.5)).tolist()


def test_a_window_that_looks_back_has_the_steps_that_there_are(subtests: pytest.Subtests) -> None:
    for low, high in BACK:
        with subtests.test(low=low, high=high):
            for choose, best, empty in ((np.minimum, min, np.inf), (np.maximum, max, -np.inf)):
                found = sliding_back(choose, HOLD, low, high, empty)
                assert found.tolist() == rows(HOLD, partial(best_behind, best, low, high, empty))


def test_since_is_until_backwards(subtests: pytest.Subtests) -> None:
    for low, high in BACK:
        with subtests.test(low=low, high=high):
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
