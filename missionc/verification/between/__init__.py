"""Verification between the steps: requirements judged at every moment of a motion."""
