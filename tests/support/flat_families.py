"""Missions with families, as somebody would write them who had none."""

from __future__ import annotations

import re

HEAD = """mission demo
time  step 1 s, horizon 10 s
world (0, 0) to (30, 30)
"""
MOVES = "radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)"
"""What a team says of its agents, but for their start."""


def flat(text: str, *families: str) -> str:
    """The text with the members of these families called as one would without them: ``w[3]`` is ``w3``."""
    return re.sub(rf"\b({'|'.join(families)})\[([\d, ]+)\]", lambda m: m[1] + m[2].replace(", ", "_"), text)
