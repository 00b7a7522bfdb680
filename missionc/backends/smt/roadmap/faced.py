"""Headings of moves on a roadmap."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.vectors import norm

STILL = 1e-9
"""Metres: who moves less within a step keeps facing where it faced."""


def faced(way: Array, turned_to: Array) -> Array:
    """Where an agent faces as each move begins, rad: along it, or of one that stays where its next state faces.

    Args:
        way: (..., dim), metres.
        turned_to: (...), rad, the heading of the state that the move leads to; NaN where that may be any.
    """
    moves = norm(way[..., :2]) > STILL
    return np.asarray(np.where(moves, np.arctan2(way[..., 1], way[..., 0]), turned_to))
