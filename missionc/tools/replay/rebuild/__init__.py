"""Rebuilding of a folder's documents from verified data, and comparison with the documents in it."""
