"""Distances to shapes, and lines of sight between them."""
