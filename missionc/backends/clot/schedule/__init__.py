"""Scheduling of a mission's tasks, and the key frames and sketch of a joint motion from a schedule."""
