"""Delta and variable-length encoding of whole numbers as text: what the page's ``unpack`` reads.

Differences of neighbours, zigzag so that small ones of either sign are small
numbers, seven bits to a byte, least significant first; a run of zeros is a
zero and its length. The bytes are written in base 64.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array

FAR = 1 << 27
"""Stands for infinity, and minus it for minus infinity."""
PER_METRE = 1000
"""Numbers are kept to a millimetre, or a thousandth of their unit."""


def thousandths(values: Array) -> NDArray[np.int64]:
    """Rounded to thousandths, (...) -> (...); infinities become ``FAR``."""
    return np.rint(np.clip(np.nan_to_num(values, nan=-np.inf), -FAR / PER_METRE, FAR / PER_METRE) * PER_METRE).astype(
        np.int64
    )


def pack(numbers: NDArray[Any]) -> str:
    """Numbers of any shape, in the order of their axes."""
    flat = np.asarray(numbers, dtype=np.int64).ravel()
    change = np.diff(flat, prepend=0)
    code = np.where(change >= 0, 2 * change, -2 * change - 1)
    zero = code == 0
    starts = np.flatnonzero(zero & ~np.concatenate([[False], zero[:-1]]))
    ends = np.flatnonzero(zero & ~np.concatenate([zero[1:], [False]]))
    # A run of zeros keeps its first place, and its length comes after that.
    place = np.concatenate([np.flatnonzero(~zero), starts, starts])
    value = np.concatenate([code[~zero], np.zeros(len(starts), dtype=np.int64), ends - starts + 1])
    second = np.concatenate([np.zeros(np.count_nonzero(~zero) + len(starts)), np.ones(len(starts))])
    return base64.b64encode(_bytes(value[np.lexsort((second, place))])).decode("ascii")


def _bytes(values: NDArray[np.int64]) -> bytes:
    """Each number in as many bytes of seven bits as it needs, all but the last with the eighth bit set."""
    lengths = np.ones(len(values), dtype=np.int64)
    for more in range(1, 9):
        lengths += values >= 1 << 7 * more
    start = np.concatenate([[0], np.cumsum(lengths)[:-1]]) if len(values) else np.zeros(0, dtype=np.int64)
    whole = np.zeros(int(lengths.sum()), dtype=np.uint8)
    for byte in range(int(lengths.max(initial=0))):
        has = lengths > byte
        more_follow = np.where(lengths[has] > byte + 1, 0x80, 0)
        whole[start[has] + byte] = ((values[has] >> 7 * byte) & 0x7F) | more_follow
    return whole.tobytes()
