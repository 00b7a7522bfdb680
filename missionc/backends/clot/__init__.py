"""Trajectory optimisation for a team: task scheduling, key frames, Levenberg-Marquardt; Algorithms 1 and 2 as presets.

Nothing is imported here: the cost graph is shown without torch, which planning needs.
"""
