"""A key frame: where everybody is at a step that matters, and by which routes they came there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias

from missionc.base.trace import Array

Routes: TypeAlias = dict[int, Array]
"""The routes, (corners, dim) in metres, by which agents come from the key frame before, where that is decided."""

NO_TOURS: Mapping[int, Array] = MappingProxyType({})
"""Where nobody is on a tour of their own."""


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """Args:
    position: (agents, dim), metres.
    shortfall: metres by which the worst margin fails at this step; at most 0 where all hold.
    """

    step: int
    position: Array
    shortfall: float
    worst: str
    routes: Routes = field(default_factory=dict)
