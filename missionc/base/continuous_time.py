"""Satisfaction of requirements in continuous time, beyond the sample times: not considered, preferred or required."""

from __future__ import annotations

from enum import Enum


class ContinuousTime(Enum):
    """Demand that a plan satisfies its requirements between the sample times too; missions define them at the samples
    only."""

    AT_STEPS = "at-steps"
    """Requirements are checked at the sample times only."""
    WANTED = "wanted"
    """A plan that satisfies the requirements between the sample times is preferred, if one is found."""
    REQUIRED = "required"
    """Every plan must satisfy the requirements between the sample times."""
