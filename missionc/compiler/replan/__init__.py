"""Replanning: the rest of a mission is replanned during its flight."""
