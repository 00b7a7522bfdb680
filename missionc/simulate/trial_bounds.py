"""Bounds of simulated trials: which engines fly, how many flights, and the largest disturbances; values alone.

The command line refuses what is beyond them, and so does whoever flies a record again.
"""

from __future__ import annotations

QUADROTOR = "quadrotor"
"""The engine that is always there."""

OTHERS = ("rotorpy", "crazyflow")
"""Those that are installed on request; they fly once and undisturbed."""

ENGINES = (QUADROTOR, *OTHERS)

MOST_FLIGHTS = 100_000
LARGEST_SEED = 2**32 - 1

MOST_WIND = 100
"""Metres per second, of the mean and of the gusts."""

MOST_MASS_ERROR = 50
"""Percent."""

MOST_START_ERROR = 1
"""Metres."""

MOST_CLOCK_ERROR = 1
"""Seconds."""

MOST_NOISE = 1
"""Metres."""

MOST_LATENCY = 1
"""Seconds."""

MOST_LOSS = 100
"""Percent: of the position updates that are lost, of the vehicles that do not hear the start, and of the thrust."""

MOST_DOWNWASH = 10
"""Times the model's force."""

MOST_LOST = 1000
"""Agents that are lost."""
