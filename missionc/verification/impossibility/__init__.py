"""Verification of a certificate of impossibility: the cover of a mission, what is claimed of it, and the proof."""
