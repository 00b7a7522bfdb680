"""Sweeps: one mission compiled for all combinations of parameter values and all seeds, into one table."""
