"""Progression of missions: the rest of a mission after its first steps, with the world at that time."""
