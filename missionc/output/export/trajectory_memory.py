"""A Crazyflie's trajectory memory, and the raw polynomial pieces in it.

Source:
    crazyflie-firmware, src/modules/src/crtp_commander_high_level.c and pptraj.c.
"""

from __future__ import annotations

import numpy as np

from missionc.geometry.curves.piecewise_polynomials import Pieces


def raw(own: Pieces) -> bytes:
    """Encode each piece as 33 little-endian float32: eight coefficients of x, y, z and yaw each, and the duration."""
    rows = np.concatenate([own.coefficients.reshape(-1, 32), own.duration[:, None]], axis=1)
    return rows.astype("<f4").tobytes()
