"""Features that a mission may need, and the offer in which a backend says which of them it has.

Values only: nothing here loads a solver.
"""

from __future__ import annotations

from enum import Enum

from missionc.base.late_dataclass import dataclass


class Feature(Enum):
    """What a mission may need of a backend; the value reads well in a message."""

    HOPS = "a route bounded in hops"
    METRIC_LENGTH = "a route bounded in metres"
    PAST_BELOW_METRES = "a look back below a route in metres"
    CONNECTED = "a graph that is connected"
    FORMATION = "a formation"
    TOTAL_TOLERANCE = "a formation with a total tolerance"
    VOLUME = "a world with three coordinates"
    MOVING_OBSTACLE = "an obstacle that moves"
    UNCERTAIN_OBSTACLE = "an obstacle that grows"
    UNICYCLE = "unicycle dynamics"
    SECOND_ORDER = "dynamics with an acceleration limit"
    DELAY = "a delay that is tolerated"
    LEAST_SPEED = "dynamics with a least speed"
    RESOURCE = "a resource"
    FLAG = "a flag"
    HEADING = "a heading that is asked for"
    EXTENSION_RULES = "dynamics with rules of an extension"
    EXTENSION_PREDICATE = "a predicate of an extension"
    PREFER = "a preference"
    DISTANCE = "`minimize distance`"
    DURATION = "`minimize duration`"
    RESTLESS_DURATION = "`minimize duration` of agents that cannot wait"
    ENERGY = "`minimize energy`"
    LANES = "a roadmap of its own"


EVERYTHING = frozenset(Feature) - {Feature.RESTLESS_DURATION, Feature.PAST_BELOW_METRES, Feature.EXTENSION_RULES}
"""All features that any built-in backend has."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A backend as it is known before it is loaded.

    Args:
        name: after ``solve with`` and ``--backend``.
        features: all that a mission it plans may need.
        options: the names of those of ``Options`` that change a plan of it.
        checkpoints: whether a run of it can be put aside and taken up again.
        home: where it is, ``module:attribute``; or it itself.
        package: what has to be installed to load it; empty for nothing.
        extra: the extra of this package that installs that.
        repeats: the backend whose attempts it makes as well; where that takes turns in a portfolio, it comes last and
            has one turn.
        weighs: whether what it makes least of is so over all options at once, and not of one that it chose before.
        presets: values of the option ``preset`` that it plans by. A backend without that option plans by them if no
            other backend is asked.
        leads: features with which it takes the first turn in a portfolio, whatever the order of the table.
    """

    name: str
    features: frozenset[Feature]
    options: frozenset[str]
    checkpoints: bool
    home: object
    package: str = ""
    extra: str = ""
    repeats: str = ""
    weighs: bool = False
    leads: frozenset[Feature] = frozenset()
    presets: frozenset[str] = frozenset()
