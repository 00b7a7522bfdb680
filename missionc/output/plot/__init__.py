"""Plots of plans and flights with matplotlib."""
