"""The names of all forms of export, for who asks which there are and exports nothing."""

from __future__ import annotations

NAMES = ("crazyswarm2", "cflib", "skybrush", "mcap", "ros2", "px4")
"""In the order of ``formats.FORMATS``."""
