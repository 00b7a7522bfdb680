"""Continuous-time satisfaction of requirements: not considered, preferred or required."""

from __future__ import annotations

from enum import Enum


class ContinuousTime(Enum):
    """Demand on requirements between the steps of a plan; their semantics is that of the steps."""

    AT_STEPS = "at-steps"
    """No demand."""
    WANTED = "wanted"
    """Satisfied between the steps if such a plan is found."""
    REQUIRED = "required"
    """Satisfied between the steps in every plan."""
