"""Names for extension packages: base classes, the types of their arguments and results, and helper functions."""

from __future__ import annotations

from missionc.base.late_names import late_names

TYPE_CHECKING = False  # as in the package itself
if TYPE_CHECKING:
    from missionc.backends.api import BackendExtension, Budget, Impossible, NotFound, Outcome, Planned, Reason, Report
    from missionc.backends.features import Feature
    from missionc.backends.options import Options
    from missionc.base.extensions import ExtensionError, Unfit
    from missionc.base.trace import Trace
    from missionc.base.units import Dimension
    from missionc.flight.simulation.default_engine import Flown, sample_times
    from missionc.flight.simulation.disturbance import setpoints
    from missionc.geometry.curves.piecewise_polynomials import Pieces
    from missionc.ir import Inside, Mission
    from missionc.ir.agents import InitialSet
    from missionc.ir.distances.signed_distance import signed_distance
    from missionc.ir.dynamics.kinds import Dynamics, Limit
    from missionc.ir.kernel import nodes
    from missionc.ir.kernel.nodes import Kernel
    from missionc.ir.language.margins.predicate_margins import of_states
    from missionc.ir.places import Beacon, Region
    from missionc.ir.predicates.place_predicate import PlacePredicate
    from missionc.output.export.export_form import Exported, Format
    from missionc.output.export.verified_flight import Flight
    from missionc.verification.verify_plan import verify

# fmt: off
__all__ = [
    "BackendExtension", "Beacon", "Budget", "Dimension", "Dynamics", "Exported", "ExtensionError", "Feature", "Flight",
    "Flown", "Format", "Impossible", "InitialSet", "Inside", "Kernel", "Limit", "Mission", "NotFound", "Options",
    "Outcome", "Pieces", "PlacePredicate", "Planned", "Reason", "Region", "Report", "Trace", "Unfit", "nodes",
    "of_states", "sample_times", "setpoints", "signed_distance", "verify",
]
# fmt: on

HOMES = {
    home: tuple(names.split())
    for home, names in {
        "missionc.backends.api": "BackendExtension Budget Impossible NotFound Outcome Planned Reason Report",
        "missionc.backends.features": "Feature",
        "missionc.backends.options": "Options",
        "missionc.base.extensions": "ExtensionError Unfit",
        "missionc.base.trace": "Trace",
        "missionc.base.units": "Dimension",
        "missionc.flight.simulation.default_engine": "Flown sample_times",
        "missionc.flight.simulation.disturbance": "setpoints",
        "missionc.geometry.curves.piecewise_polynomials": "Pieces",
        "missionc.ir": "Inside Mission",
        "missionc.ir.agents": "InitialSet",
        "missionc.ir.distances.signed_distance": "signed_distance",
        "missionc.ir.dynamics.kinds": "Dynamics Limit",
        "missionc.ir.kernel": "nodes",
        "missionc.ir.kernel.nodes": "Kernel",
        "missionc.ir.language.margins.predicate_margins": "of_states",
        "missionc.ir.places": "Beacon Region",
        "missionc.ir.predicates.place_predicate": "PlacePredicate",
        "missionc.output.export.export_form": "Exported Format",
        "missionc.output.export.verified_flight": "Flight",
        "missionc.verification.verify_plan": "verify",
    }.items()
}
"""Module that defines each name, loaded at first use: a check with a predicate of an extension loads no planner."""

__getattr__ = late_names(__name__, HOMES)


def __dir__() -> list[str]:
    return __all__
