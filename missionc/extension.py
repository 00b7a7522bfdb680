"""Names for packages of extensions: base classes, with the types of their arguments and results."""

from __future__ import annotations

from missionc.base.late_names import late_names

TYPE_CHECKING = False  # as in the package itself
if TYPE_CHECKING:
    from missionc.backends.api import BackendExtension as BackendExtension
    from missionc.backends.api import Budget as Budget
    from missionc.backends.api import Impossible as Impossible
    from missionc.backends.api import NotFound as NotFound
    from missionc.backends.api import Outcome as Outcome
    from missionc.backends.api import Planned as Planned
    from missionc.backends.api import Reason as Reason
    from missionc.backends.api import Report as Report
    from missionc.backends.features import Feature as Feature
    from missionc.backends.options import Options as Options
    from missionc.base.extensions import Unfit as Unfit
    from missionc.base.trace import Trace as Trace
    from missionc.base.units import Dimension as Dimension
    from missionc.flight.simulation.default_engine import Flown as Flown
    from missionc.flight.simulation.default_engine import sample_times as sample_times
    from missionc.flight.simulation.disturbance import setpoints as setpoints
    from missionc.geometry.curves.piecewise_polynomials import Pieces as Pieces
    from missionc.ir import Mission as Mission
    from missionc.ir.agents import InitialSet as InitialSet
    from missionc.ir.dynamics.kind import Dynamics as Dynamics
    from missionc.ir.dynamics.kind import Limit as Limit
    from missionc.ir.kernel.nodes import Kernel as Kernel
    from missionc.ir.places import Beacon as Beacon
    from missionc.ir.places import Region as Region
    from missionc.ir.predicates.place_predicate import PlacePredicate as PlacePredicate
    from missionc.output.export.export_form import Exported as Exported
    from missionc.output.export.export_form import Format as Format
    from missionc.output.export.verified_flight import Flight as Flight
    from missionc.verification.verify_plan import verify as verify

HOMES = {
    "missionc.backends.api": (
        "BackendExtension",
        "Budget",
        "Impossible",
        "NotFound",
        "Outcome",
        "Planned",
        "Reason",
        "Report",
    ),
    "missionc.backends.features": ("Feature",),
    "missionc.backends.options": ("Options",),
    "missionc.base.extensions": ("Unfit",),
    "missionc.base.trace": ("Trace",),
    "missionc.base.units": ("Dimension",),
    "missionc.flight.simulation.default_engine": ("Flown", "sample_times"),
    "missionc.flight.simulation.disturbance": ("setpoints",),
    "missionc.geometry.curves.piecewise_polynomials": ("Pieces",),
    "missionc.ir": ("Mission",),
    "missionc.ir.agents": ("InitialSet",),
    "missionc.ir.dynamics.kind": ("Dynamics", "Limit"),
    "missionc.ir.places": ("Beacon", "Region"),
    "missionc.ir.predicates.place_predicate": ("PlacePredicate",),
    "missionc.ir.kernel.nodes": ("Kernel",),
    "missionc.output.export.export_form": ("Exported", "Format"),
    "missionc.output.export.verified_flight": ("Flight",),
    "missionc.verification.verify_plan": ("verify",),
}
"""Module of each name, loaded at first use: a check with a foreign predicate loads no planner."""

__getattr__ = late_names(__name__, HOMES)
