"""Flights of verified plans: trajectories for vehicles, and their simulation."""
