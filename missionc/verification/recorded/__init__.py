"""Constraints of a recorded flight: what a mission implies beside its requirements, judged on sampled states."""
