"""Trajectory generation: smooth polynomials fitted to a plan, within vehicle limits."""
