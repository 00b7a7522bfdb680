"""Downwash: the force that a vehicle's rotors push those below it down with.

Source:
    Panerati et al., "Learning to Fly: a Gym Environment with PyBullet Physics for Reinforcement Learning of Multi-agent
    Quadcopter Control" (2021), III-B, and the figures for a Crazyflie 2.x that its code has.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array

ROTOR = 0.0231348
"""Radius of a rotor, m."""
STRENGTH = 2267.18
"""N, of a rotor's radius below."""
WIDTH = (-0.11, 0.16)
"""Metres at no distance, and for each metre below: how wide the stream is."""
NEAREST = 0.1
"""Metres below: nearer, the model grows beyond all bounds, and bodies touch."""


def push(position: Array, together: int, still: NDArray[np.bool_] | None = None) -> Array:
    """Downward force on each body, of all that are above it: (3, bodies), m -> (bodies,), N.

    Args:
        together: so many neighbouring columns fly in the same air.
        still: (bodies,): whose rotors stand; nobody's where none is given.
    """
    x, y, z = position.reshape(3, -1, together)
    below = z[:, None, :] - z[:, :, None]
    beside = (x[:, None, :] - x[:, :, None]) ** 2 + (y[:, None, :] - y[:, :, None]) ** 2
    height = np.maximum(below, NEAREST)
    width = np.maximum(np.abs(WIDTH[0] + WIDTH[1] * height), 1e-3)
    each = STRENGTH * (ROTOR / (4 * height)) ** 2 * np.exp(-beside / (2 * width**2))
    blows = below > 0
    if still is not None:
        blows &= ~still.reshape(-1, 1, together)
    return np.asarray(np.where(blows, each, 0.0).sum(axis=-1).ravel())
