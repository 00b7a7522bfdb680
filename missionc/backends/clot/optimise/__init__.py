"""Trajectory optimisation: splines that obey the dynamics, residuals, Levenberg-Marquardt on all at once."""
