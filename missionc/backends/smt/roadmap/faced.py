"""Headings of moves on a roadmap."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.vectors import norm


def faced(way: Array, turned_to: Array) -> Array:
    """Where an agent faces as each move begins, rad: along it, or of one that stays where its next state faces.

    Args:
        way: (..., dim), metres.
        turned_to: (...), rad, the heading of the state that the move leads to; NaN where that may be any.
    """
    still = 1e-9  # metres; an agent that moves less in a step keeps its heading
    moves = norm(way[..., :2]) > still
    return np.asarray(np.where(moves, np.arctan2(way[..., 1], way[..., 0]), turned_to))
