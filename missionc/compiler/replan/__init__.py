"""Replanning: a new plan for the remaining part of a mission during its flight."""
