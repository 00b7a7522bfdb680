"""Description of the hybrid backend: features that both of its parts support, and options that either part supports."""

from __future__ import annotations

from missionc.backends.clot.spec import CLOT
from missionc.backends.features import BackendSpec, Feature
from missionc.backends.smt.spec import SMT

HYBRID = BackendSpec(
    "hybrid",
    CLOT.features | {Feature.HOPS},
    SMT.options | CLOT.options,
    checkpoints=True,
    home="missionc.backends.hybrid.backend:BACKEND",
    package=CLOT.package,
    extra=CLOT.extra,
    package_needs=CLOT.package_needs,
    subsumes=CLOT.name,
    presets=CLOT.presets,
)
