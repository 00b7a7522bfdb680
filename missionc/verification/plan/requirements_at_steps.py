"""Requirements at the steps of a plan, as checks with the monitor's truth and robustness."""

from __future__ import annotations

from missionc.base.judgement import Judgements
from missionc.ir import Mission
from missionc.verification.certificate import Check, Figure


def check_requirements(mission: Mission, judgements: Judgements) -> tuple[list[Check], list[Figure]]:
    """A check for each requirement, with its robustness as margin, and an informative quantity for each preference."""
    checks = [
        Check(
            name="requirement",
            subject=judgement.name,
            margin=judgement.robustness,
            unit=judgement.unit,
            tolerance=0.0,
            passed=judgement.satisfied,
            at=None if judgement.step is None else judgement.step * mission.step,
            agents=judgement.agents,
            detail="evaluated by the monitor at the sample times",
        )
        for judgement in judgements.requirements
    ]
    return checks, [Figure("preference", each.name, each.robustness, each.unit) for each in judgements.preferences]
