"""Rebuilding of a folder's documents from what was verified, and comparison with those that lie in it."""
