"""Constraints of a recorded flight: implied conditions of a mission, judged on sampled states."""
