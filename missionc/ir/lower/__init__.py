"""Lowering of missions: expansion to kernel formulas, and tightening for vehicles, delays and continuous time."""
