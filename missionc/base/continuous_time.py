"""Continuous-time satisfaction of requirements: not considered, wanted or required."""

from __future__ import annotations

from enum import Enum


class ContinuousTime(Enum):
    """Demand on requirements between the steps of a plan; their semantics are those of the steps."""

    AT_STEPS = "at-steps"
    """Nothing."""
    WANTED = "wanted"
    """That they hold, where such a plan is found."""
    REQUIRED = "required"
    """That they hold; no other plan is one."""
