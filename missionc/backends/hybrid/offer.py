"""The offer of the hybrid backend: what both halves have together, and the options of either."""

from __future__ import annotations

from missionc.backends.clot.offer import CLOT
from missionc.backends.features import Feature, Offer
from missionc.backends.smt.offer import SMT

HYBRID = Offer(
    "hybrid",
    CLOT.features | {Feature.HOPS},
    SMT.options | CLOT.options,
    checkpoints=True,
    home="missionc.backends.hybrid.backend:BACKEND",
    package=CLOT.package,
    extra=CLOT.extra,
    repeats=CLOT.name,
    presets=CLOT.presets,
)
