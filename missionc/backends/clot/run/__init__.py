"""Run of the trajectory optimiser: presets, state between attempts, and attempts in child processes."""
