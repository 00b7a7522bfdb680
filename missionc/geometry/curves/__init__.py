"""Curves of flights: piecewise polynomials, their Bernstein enclosures, and the table that a Crazyflie flies."""
