"""From a verified plan to what a vehicle flies: trajectories, and their simulation."""
