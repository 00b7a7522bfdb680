"""Verification between samples: truth of requirements in continuous time, along the fitted trajectories."""
