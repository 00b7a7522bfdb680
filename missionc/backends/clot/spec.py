"""Description of the clot backend: supported features and options, without loading the planner. [clot]"""

from __future__ import annotations

from missionc.backends.features import EVERYTHING, BackendSpec, Feature
from missionc.backends.options import DEVICES, TRANSPORT_PRESETS

CLOT = BackendSpec(
    "clot",
    EVERYTHING - {Feature.HOPS, Feature.LANES},
    frozenset({"preset", "samples", "device", "margin", "processes", "stretch"}),
    checkpoints=True,
    home="missionc.backends.clot.backend:BACKEND",
    package="torch",
    extra="clot",
    package_needs=(("preset", frozenset(TRANSPORT_PRESETS) - {"sketch"}), ("device", frozenset(DEVICES[1:]))),
    presets=frozenset(TRANSPORT_PRESETS),
    preferred_for=frozenset(
        {
            Feature.FORMATION,
            Feature.METRIC_LENGTH,
            Feature.TOTAL_TOLERANCE,
            Feature.CONNECTED,
            Feature.SECOND_ORDER,
            Feature.LEAST_SPEED,
        }
    ),
)
