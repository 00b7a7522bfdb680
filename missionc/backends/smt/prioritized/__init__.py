"""Prioritized planning: a few agents at a time, in an order, around the reserved trajectories of earlier agents."""
