"""Verification of flights: every claim about the vehicles' polynomials, proved in continuous time."""
