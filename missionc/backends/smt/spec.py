"""Description of the smt backend: supported features and options, without loading the planner. [strel]"""

from __future__ import annotations

from missionc.backends.features import EVERYTHING, BackendSpec, Feature
from missionc.backends.options import ROADMAP_PRESETS

SMT = BackendSpec(
    "smt",
    EVERYTHING - {Feature.TOTAL_TOLERANCE, Feature.ENERGY, Feature.ROBUSTNESS},
    frozenset({"solver", "require_solver", "certify", "margin", "stretch"}),
    checkpoints=False,
    home="missionc.backends.smt.backend:BACKEND",
    optimises_globally=True,
    presets=frozenset(ROADMAP_PRESETS),
)
