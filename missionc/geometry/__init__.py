"""Geometry of the world and motion of agents: distances, clearance, free space, curves, dynamics within a step."""
