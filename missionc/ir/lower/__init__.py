"""Lowering: the choice of a backend, and the mission as meant expanded to kernel formulas."""
