"""Demands on requirements between the steps of a plan, beside what they mean."""

from __future__ import annotations

from enum import Enum


class ContinuousTime(Enum):
    """What is asked of requirements between the steps, beside what they mean, which the steps say."""

    AT_STEPS = "at-steps"
    """Nothing."""
    WANTED = "wanted"
    """That they hold, where such a plan is found."""
    REQUIRED = "required"
    """That they hold; no other plan is one."""
