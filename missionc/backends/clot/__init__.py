"""Trajectory optimisation for a team: task scheduling, key frames, Levenberg-Marquardt.

Algorithms 1 and 2 as presets.

This module imports nothing, so that the cost graph can be printed without the libraries that planning needs.
"""
