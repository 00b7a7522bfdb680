"""Plots of plans and flights by matplotlib."""
