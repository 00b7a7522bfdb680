"""Predicates: atomic propositions about an agent, or about the team, at one step; each kind in a file of its own.

A predicate is data with facts: whoever asks something of one asks it, and knows no kind
(``facts``). What it measures, how fast, and how it is said it says over ``views``.
"""

from __future__ import annotations

from typing import TypeAlias

from missionc.ir.predicates.compare import Compare
from missionc.ir.predicates.connected import Connected
from missionc.ir.predicates.facing import Facing
from missionc.ir.predicates.features import (
    Altitude,
    Coordinate,
    DistanceBetween,
    DistanceTo,
    Feature,
    Level,
    Speed,
)
from missionc.ir.predicates.flagged import Flagged
from missionc.ir.predicates.in_formation import InFormation
from missionc.ir.predicates.in_region import Inside, Touches

Predicate: TypeAlias = Inside | Touches | Compare | Connected | InFormation | Flagged | Facing

__all__ = [
    "Altitude",
    "Compare",
    "Connected",
    "Coordinate",
    "DistanceBetween",
    "DistanceTo",
    "Facing",
    "Feature",
    "Flagged",
    "InFormation",
    "Inside",
    "Level",
    "Predicate",
    "Speed",
    "Touches",
]
