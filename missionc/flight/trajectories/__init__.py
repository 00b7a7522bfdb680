"""Trajectory generation: smooth polynomials fitted to a plan, within what vehicles can do."""
