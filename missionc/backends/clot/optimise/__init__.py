"""Local trajectory optimisation: splines that satisfy the dynamics, residuals, Levenberg-Marquardt over all agents."""
