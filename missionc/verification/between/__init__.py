"""Verification between the steps: requirements judged in continuous time."""
