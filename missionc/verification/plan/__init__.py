"""Verification of plans: dynamics, starts and finishes, clearance, separation and requirements of a joint motion."""
