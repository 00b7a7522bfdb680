"""Curves of flights: piecewise polynomials, their Bernstein enclosures, and the trajectory table of a Crazyflie."""
