"""Replay of an output folder from its files alone: verification, simulation and redrawing."""
