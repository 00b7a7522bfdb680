"""Verification of flights: every claim about the polynomials that vehicles fly, proved at every moment."""
