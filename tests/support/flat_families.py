"""Missions with families, rewritten without families."""

from __future__ import annotations

import re

HEAD = """mission demo
time  step 1 s, horizon 10 s
world (0, 0) to (30, 30)
"""
MOVES = "radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)"
"""Items of a team, except its start."""


def flat(text: str, *families: str) -> str:
    """Text with the members of these families as ordinary names: ``w[3]`` is ``w3``."""
    return re.sub(rf"\b({'|'.join(families)})\[([\d, ]+)\]", lambda m: m[1] + m[2].replace(", ", "_"), text)
