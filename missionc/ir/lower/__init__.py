"""Lowering: the choice of a backend, and the expansion of the mission to kernel formulas."""
