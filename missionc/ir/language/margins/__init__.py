"""Margins of predicates: signed distances to the boundary of truth, one module per kind of margin."""
