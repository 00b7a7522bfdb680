"""Margins of predicates: signed distances to the border of truth, one module for each."""
