"""Scheduling of a mission's tasks, and joint waypoints and an initial trajectory from a schedule."""
