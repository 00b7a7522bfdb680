"""Verification of a certificate of impossibility: the cover of a mission, its claims, and the proof."""
