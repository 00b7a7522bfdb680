"""From a verified plan to flights: trajectories, and their simulation."""
