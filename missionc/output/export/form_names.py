"""The registry of export formats: those built in, each a module beside this one, and those of extensions.

Whoever asks which there are, as completion and help do, loads none of those built in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from missionc.base.extensions import Kind, Registry, Unfit

if TYPE_CHECKING:
    from missionc.output.export.export_form import Format

NAMES = ("crazyswarm2", "cflib", "skybrush", "mcap", "ros2", "px4")
"""The built-in formats, each a module with a ``FORMAT`` of its name."""


def _format(name: str, value: object) -> Format:
    from missionc.output.export.export_form import Format

    if not (isinstance(value, Format) and value.name == name):
        raise Unfit(f"an export is a `Format` with the name `{name}`")
    return value


FORMATS: Registry[Format] = Registry(
    Kind.EXPORT, {name: f"missionc.output.export.{name}:FORMAT" for name in NAMES}, _format
)
"""Every form by its name."""
