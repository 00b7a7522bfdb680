"""The estimate of position and velocity that a controller is shown: late, with updates missing, beside the truth."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array


class Estimate:
    """One for each body. A state is position and velocity, (6, bodies), m and m/s.

    Args:
        first: the state that they begin in, and have been in.
        late: a state is shown so many commands later.
        seconds: between two commands.
    """

    def __init__(self, first: Array, late: int, seconds: float) -> None:
        self._past = deque([first.copy()] * late)
        self._seconds = seconds
        self._held: Array | None = None

    def shown(self, state: Array, noise: Array | None, stale: NDArray[np.bool_] | None) -> tuple[Array, Array]:
        """Position and velocity for this command: (3, bodies) twice.

        Args:
            noise: (3, bodies), m, added to the position.
            stale: (bodies,): those to whom no update comes are shown where they would be at the velocity that they were
                last shown.
        """
        fresh = state
        if self._past:
            self._past.append(state.copy())
            fresh = self._past.popleft()
        if stale is not None:
            gone_on = fresh if self._held is None else self._held.copy()
            if self._held is not None:
                gone_on[:3] += self._seconds * self._held[3:]
            fresh = self._held = np.where(stale, gone_on, fresh)
        position = fresh[:3] if noise is None else fresh[:3] + noise
        return position, fresh[3:]
