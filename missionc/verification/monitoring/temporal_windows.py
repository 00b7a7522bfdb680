"""Sliding windows and *until* along the last axis of an array, for truth and for robustness alike.

``numpy.minimum`` and ``numpy.maximum`` are *and* and *or* on truth values. A window that runs past the last step is
``undefined``; the horizon check ensures that no goal reads such a value.
"""

from __future__ import annotations

import numpy as np

from missionc.verification.monitoring.logic import Logic, Values


def sliding(choose: np.ufunc, values: Values, low: int, high: int | None, undefined: object) -> Values:
    """Minimum or maximum (``choose``) over the window ahead of every step: (..., steps) -> (..., steps).

    The cost is O(steps log window).

    Args:
        low, high: the window in steps ahead; ``high`` None means up to the last step.
        undefined: value at steps whose window runs past the last step.
    """
    steps = values.shape[-1]
    result = np.full_like(values, undefined)
    if high is None:
        if low < steps:
            suffix = choose.accumulate(values[..., ::-1], axis=-1)[..., ::-1]
            result[..., : steps - low] = suffix[..., low:]
    elif high < steps:
        result[..., : steps - high] = _over(choose, values[..., low:], high - low + 1)
    return result


def until(hold: Values, end: Values, low: int, high: int | None, undefined: object) -> Values:
    """Value of "``end`` holds at some step of the window, and ``hold`` from now until then".

    Shape: (..., steps) -> (..., steps).

    Args:
        low, high: the window in steps ahead; ``high`` None means up to the last step.
        undefined: value at steps whose window runs past the last step.
    """
    hold, end = np.broadcast_arrays(hold, end)
    steps = hold.shape[-1]
    result = np.full_like(end, undefined)
    last = steps - 1 if high is None else high
    if last >= steps or low >= steps:
        return result
    if high is None:
        beyond = np.full((*end.shape[:-1], steps - 1 - low), undefined, dtype=end.dtype)
        freed = _until_within(np.concatenate((hold, beyond), -1), np.concatenate((end, beyond), -1), steps - low)
        defined = steps - low
    else:
        freed = _until_within(hold, end, high - low + 1)
        defined = steps - high
    chosen = freed[..., low : low + defined]
    if low > 0:
        chosen = np.minimum(_over(np.minimum, hold, low)[..., :defined], chosen)
    result[..., :defined] = chosen
    return result


def sliding_back(choose: np.ufunc, values: Values, low: int, high: int, empty: object) -> Values:
    """Minimum or maximum (``choose``) over the past window of every step; ``empty`` if the window contains no step.

    Args:
        low, high: the window in steps ahead, so both are at most 0.
    """
    steps = values.shape[-1]
    low = max(low, -steps)
    if -high >= steps:
        return np.full_like(values, empty)
    before = np.full((*values.shape[:-1], -low), empty, dtype=values.dtype)
    return _over(choose, np.concatenate((before, values), -1), high - low + 1)[..., :steps]


def since(hold: Values, end: Values, low: int, high: int, bottom: object) -> Values:
    """Value of "``end`` held at some step of the past window, and ``hold`` from then until now".

    Nothing holds before the first step.

    Shape: (..., steps) -> (..., steps).

    Args:
        low, high: the window in steps ahead, so both are at most 0.
    """
    hold, end = np.broadcast_arrays(hold, end)
    steps = hold.shape[-1]
    low = max(low, -steps)
    if -high >= steps:
        return np.full_like(end, bottom)
    beyond = np.full((*end.shape[:-1], -low), bottom, dtype=end.dtype)
    hold, end = (np.concatenate((value[..., ::-1], beyond), -1) for value in (hold, end))
    return until(hold, end, -high, -low, bottom)[..., :steps][..., ::-1]


def release(logic: Logic, free: Values, end: Values, low: int, high: int | None) -> Values:
    """Dual of ``until`` and of ``since``: ``end`` holds at every step of the window, or ``free`` at an earlier step.

    Args:
        low, high: the window in steps ahead; negative for the dual of ``since``.
    """
    if low < 0 and high is not None:
        return np.asarray(logic.negate(since(logic.negate(free), logic.negate(end), low, high, logic.bottom)))
    freed: Values = logic.negate(until(logic.negate(free), logic.negate(end), low, high, logic.bottom))
    steps = freed.shape[-1]
    freed[..., max(steps - (low if high is None else high), 0) :] = logic.bottom
    return freed


def _over(choose: np.ufunc, values: Values, width: int) -> Values:
    """Minimum or maximum (``choose``) over every ``width`` adjacent steps, by doubling.

    The result is ``width - 1`` shorter.
    """
    done = 1
    while 2 * done <= width:
        values = choose(values[..., :-done], values[..., done:])
        done *= 2
    rest = width - done
    return choose(values[..., : values.shape[-1] - rest], values[..., rest:]) if rest else values


def _until_within(hold: Values, end: Values, width: int) -> Values:
    """Value of ``until`` over the first ``width`` steps from every step; the result is ``width - 1`` shorter.

    A range of steps is summarised by two values: ``hold`` over all of it, and the until within it. Two adjacent ranges
    join into one, so that a range of any width is built by doubling.
    """

    def joined(left: tuple[Values, Values], right: tuple[Values, Values], width: int) -> tuple[Values, Values]:
        size = min(left[0].shape[-1], right[0].shape[-1] - width)
        held, freed = left[0][..., :size], left[1][..., :size]
        later_held, later_freed = right[0][..., width : width + size], right[1][..., width : width + size]
        return np.minimum(held, later_held), np.maximum(freed, np.minimum(held, later_freed))

    stretch, size = (hold, end), 1
    whole, done = stretch, 0
    while True:
        if width & size:
            whole = joined(whole, stretch, done) if done else stretch
            done += size
        if done == width:
            return whole[1]
        stretch = joined(stretch, stretch, size)
        size *= 2
