"""Replanning: the rest of a mission planned anew while it is flown."""
