"""Constraints of a recorded flight: conditions that a mission implies, evaluated on sampled states."""
