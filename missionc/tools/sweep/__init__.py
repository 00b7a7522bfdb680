"""Sweeps: one mission compiled for every combination of some parameters' values and every seed, into one table."""
