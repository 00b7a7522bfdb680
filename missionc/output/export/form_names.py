"""Names of the export formats: the only place where one is registered.

Whoever asks which there are, as completion and help do, loads none of them.
"""

from __future__ import annotations

NAMES = ("crazyswarm2", "cflib", "skybrush", "mcap", "ros2", "px4")
"""Each is a module beside this one, with a ``FORMAT`` of its name."""
