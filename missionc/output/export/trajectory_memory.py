"""Raw polynomial pieces as a Crazyflie stores them in its trajectory memory.

Source:
    crazyflie-firmware, src/modules/src/crtp_commander_high_level.c and pptraj.c.
"""

from __future__ import annotations

import numpy as np

from missionc.geometry.curves.piecewise_polynomials import Pieces


def raw(own: Pieces) -> bytes:
    """Bytes of a trajectory: 33 little-endian float32 for each piece, eight coefficients each of x, y, z and yaw, and
    the duration.
    """
    rows = np.concatenate([own.coefficients.reshape(-1, 32), own.duration[:, None]], axis=1)
    return rows.astype("<f4").tobytes()
