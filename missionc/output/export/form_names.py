"""Registry of export formats: built-in formats, each a module next to this one, and those of extensions.

Listing the names, as completion and help do, loads no built-in format.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from missionc.base.extensions import Kind, Registry, Unfit

if TYPE_CHECKING:
    from missionc.output.export.export_form import Format

NAMES = ("crazyswarm2", "cflib", "skybrush", "mcap", "ros2", "px4")
"""Names of the built-in formats; each is a module that defines ``FORMAT``."""


def _format(name: str, value: object) -> Format:
    from missionc.output.export.export_form import Format

    if not (isinstance(value, Format) and value.name == name):
        raise Unfit(f"an export is a `Format` with the name `{name}`")
    return value


FORMATS: Registry[Format] = Registry(
    Kind.EXPORT, {name: f"missionc.output.export.{name}:FORMAT" for name in NAMES}, _format
)
"""Registry of all export formats, by name."""
