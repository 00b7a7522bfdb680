"""Features that missions may need, and descriptions of backends with the features that they support.

The module contains values only and loads no solver.
"""

from __future__ import annotations

from enum import Enum

from missionc.base.late_dataclass import Record


class Feature(Enum):
    """Feature of a mission that a backend must support; the value is its name in messages."""

    HOPS = "a route bounded in hops"
    METRIC_LENGTH = "a route bounded in metres"
    PAST_BELOW_METRES = "a past operator inside a route in metres"
    CONNECTED = "the connectivity of a graph"
    FORMATION = "a formation"
    TOTAL_TOLERANCE = "a formation with a total tolerance"
    VOLUME = "a world with three coordinates"
    MOVING_OBSTACLE = "an obstacle that moves"
    UNCERTAIN_OBSTACLE = "an obstacle that grows"
    UNICYCLE = "unicycle dynamics"
    SECOND_ORDER = "dynamics with an acceleration limit"
    DELAY = "a tolerated delay"
    LEAST_SPEED = "dynamics with a least speed"
    RESOURCE = "a resource"
    FLAG = "a flag"
    HEADING = "a heading"
    EXTENSION_RULES = "dynamics with rules of an extension"
    EXTENSION_PREDICATE = "a predicate of an extension"
    PREFER = "a preference"
    DISTANCE = "`minimize distance`"
    DURATION = "`minimize duration`"
    RESTLESS_DURATION = "`minimize duration` for agents that cannot wait"
    ENERGY = "`minimize energy`"
    ROBUSTNESS = "`maximize robustness`"
    LANES = "a roadmap of the mission"


EVERYTHING = frozenset(Feature) - {Feature.RESTLESS_DURATION, Feature.PAST_BELOW_METRES, Feature.EXTENSION_RULES}
"""All features that at least one built-in backend supports."""


class BackendSpec(Record):
    """Description of a backend before it is loaded.

    Args:
        name: the word after ``solve with`` and ``--backend``.
        features: the features of missions that the backend can plan.
        options: names of the fields of ``Options`` that affect its plans.
        checkpoints: True if a run can be saved and resumed.
        home: the backend, or where to load it from, as ``module:attribute``.
        package: the package that some values of options import.
        extra: the extra of missionc that installs ``package``.
        package_needs: names of options, and their values that import ``package``.
        subsumes: the name of a backend whose attempts this one repeats. In a portfolio with that backend, this one
            goes last and has one turn.
        optimises_globally: True if the backend minimises over all options of a disjunction together, False if it
            chooses an option first.
        presets: values of the option ``preset`` that the backend accepts. Without the option ``preset``, it accepts
            them only if it is the only backend.
        preferred_for: features of missions for which the backend takes the first turn in a portfolio.
    """

    name: str
    features: frozenset[Feature]
    options: frozenset[str]
    checkpoints: bool
    home: object
    package: str = ""
    extra: str = ""
    package_needs: tuple[tuple[str, frozenset[str]], ...] = ()
    subsumes: str = ""
    optimises_globally: bool = False
    preferred_for: frozenset[Feature] = frozenset()
    presets: frozenset[str] = frozenset()
