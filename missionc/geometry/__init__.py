"""Geometry and dynamics of the world: signed distances, clearance, free space, motion within a step."""
