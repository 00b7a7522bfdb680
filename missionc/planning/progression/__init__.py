"""Progression of missions: what is left of one after its first steps, with the world as it is then."""
