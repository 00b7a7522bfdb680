"""Predicates: atomic propositions about an agent, or the team, at one step; each kind has its own file.

A predicate is data with facts; callers read its facts and never test for a kind (``facts``). Each predicate defines its
measure, rate and wording over ``views``.
"""

from __future__ import annotations

from typing import TypeAlias

from missionc.ir.predicates.compare import Compare as Compare
from missionc.ir.predicates.connected import Connected as Connected
from missionc.ir.predicates.during_motion import DuringMotion as DuringMotion
from missionc.ir.predicates.facing import Facing as Facing
from missionc.ir.predicates.features import Altitude as Altitude
from missionc.ir.predicates.features import Coordinate as Coordinate
from missionc.ir.predicates.features import DistanceBetween as DistanceBetween
from missionc.ir.predicates.features import DistanceTo as DistanceTo
from missionc.ir.predicates.features import Feature as Feature
from missionc.ir.predicates.features import Level as Level
from missionc.ir.predicates.features import Speed as Speed
from missionc.ir.predicates.flagged import Flagged as Flagged
from missionc.ir.predicates.in_formation import InFormation as InFormation
from missionc.ir.predicates.in_region import Inside as Inside
from missionc.ir.predicates.in_region import Touches as Touches
from missionc.ir.predicates.place_predicate import PlacePredicate as PlacePredicate

Predicate: TypeAlias = (
    Inside | Touches | Compare | Connected | InFormation | Flagged | Facing | PlacePredicate | DuringMotion
)
