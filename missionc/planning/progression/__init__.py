"""Progression of missions: the remaining mission after some steps, with the world at that time."""
