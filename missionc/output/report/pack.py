"""Delta and variable-length encoding of integers as text, which the page's ``unpack`` reads.

Numbers become first or second differences, in zigzag code, so that small values of either sign are small numbers. They
are written in digits of three or seven bits, least significant first, each with a bit that tells whether more follow; a
run of zeros is a zero and its length. The shortest of these four encodings is used. The first byte names it: the order
of the differences, plus four for digits of seven bits. Of two digits in a byte the first is the lower one, and an
unused half byte has all bits set. The bytes are encoded in base 64.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array

FAR = 1 << 27
"""Integer that represents infinity; its negative represents minus infinity."""
WIDE = 4
"""Flag in the first byte of a text for digits of seven bits."""
PER_METRE, COARSE = 1000, 100
"""Units per metre: numbers are stored in thousandths of their unit, or in hundredths if there are many."""


def thousandths(values: Array) -> NDArray[np.int64]:
    """Values rounded to integer thousandths, (...) -> (...); infinities become ``FAR``."""
    return rounded(values, PER_METRE)


def rounded(values: Array, per_unit: int) -> NDArray[np.int64]:
    """Values rounded to integer multiples of ``1 / per_unit``, (...) -> (...); infinities become ``FAR``."""
    finite = np.clip(np.nan_to_num(values, nan=-np.inf), -FAR / per_unit, FAR / per_unit)
    return np.rint(finite * per_unit).astype(np.int64)


def pack(numbers: NDArray[Any]) -> str:
    """Text that encodes integers of any shape, (...), in the order of their axes."""
    flat = np.asarray(numbers, dtype=np.int64).ravel()
    once = np.diff(flat, prepend=0)
    codes = [(1, _zigzag(once)), (2, _zigzag(np.diff(once, prepend=0)))]
    written = [bytes([times | wide]) + _bytes(code, wide) for times, code in codes for wide in (0, WIDE)]
    return base64.b64encode(min(written, key=len)).decode("ascii")


def _zigzag(change: NDArray[np.int64]) -> NDArray[np.int64]:
    """Zigzag code of integers, (numbers,) -> (codes,), with each run of zeros as one zero and its length."""
    code = np.where(change >= 0, 2 * change, -2 * change - 1)
    zero = code == 0
    starts = np.flatnonzero(zero & ~np.concatenate([[False], zero[:-1]]))
    ends = np.flatnonzero(zero & ~np.concatenate([zero[1:], [False]]))
    # A run of zeros keeps its first place, and its length comes after that.
    place = np.concatenate([np.flatnonzero(~zero), starts, starts])
    value = np.concatenate([code[~zero], np.zeros(len(starts), dtype=np.int64), ends - starts + 1])
    second = np.concatenate([np.zeros(np.count_nonzero(~zero) + len(starts)), np.ones(len(starts))])
    return np.asarray(value[np.lexsort((second, place))])


def _bytes(values: NDArray[np.int64], wide: int) -> bytes:
    """Bytes of numbers, (numbers,), each in as many digits as needed.

    All digits of a number except the last have their highest bit set.
    """
    bits = 7 if wide else 3
    lengths = np.ones(len(values), dtype=np.int64)
    for more in range(1, 63 // bits):
        lengths += values >= 1 << bits * more
    start = np.concatenate([[0], np.cumsum(lengths)[:-1]]) if len(values) else np.zeros(0, dtype=np.int64)
    digits = np.zeros(int(lengths.sum()), dtype=np.uint8)
    for digit in range(int(lengths.max(initial=0))):
        has = lengths > digit
        more_follow = np.where(lengths[has] > digit + 1, 1 << bits, 0)
        digits[start[has] + digit] = ((values[has] >> bits * digit) & ((1 << bits) - 1)) | more_follow
    if wide:
        return digits.tobytes()
    pairs = np.append(digits, np.full(len(digits) % 2, 15, dtype=np.uint8)).reshape(-1, 2)
    return np.asarray(pairs[:, 0] | pairs[:, 1] << 4, dtype=np.uint8).tobytes()
