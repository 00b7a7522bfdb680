"""Verification of plans: dynamics, starts, finishes, clearance, separation and requirements of joint trajectories."""
