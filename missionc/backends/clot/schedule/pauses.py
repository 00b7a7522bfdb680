"""Pauses: the time that an agent takes between two ways."""

from __future__ import annotations

import numpy as np

from missionc.geometry.dynamics import can_wait
from missionc.ir import Dynamics

ABOUT = np.pi
"""Radians by which an agent that can stand turns between two ways."""


def pause(dynamics: Dynamics) -> float:
    """Seconds that it takes to stop and speed up between two ways, or to turn where it stands."""
    turning = ABOUT / dynamics.top_turn if can_wait(dynamics) else 0.0
    return dynamics.top_speed / dynamics.top_acceleration + turning
