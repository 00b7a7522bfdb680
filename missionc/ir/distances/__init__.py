"""Distances to shapes, and what one shape hides of another."""
