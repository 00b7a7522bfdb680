"""Verification of plans: dynamics, ends, clearance, separation and requirements along a joint motion."""
