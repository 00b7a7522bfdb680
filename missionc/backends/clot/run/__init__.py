"""A run of the trajectory optimiser: its settings, its state between attempts, and attempts in child processes."""
