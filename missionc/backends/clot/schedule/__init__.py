"""Scheduling of a mission's tasks, and the key frames and the sketch of a joint motion that come of a schedule."""
