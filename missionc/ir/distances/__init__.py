"""Distances from points to shapes, and clearance of lines of sight from shapes."""
