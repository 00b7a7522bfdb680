"""The forms of files that places are read from, by the endings of their names.

in   Asked
out  features, or what is wrong with the file
says MC004 MC033 MC034 MC035 MC404
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from missionc.base.late_dataclass import dataclass
from missionc.diagnostics.model import Diagnostic
from missionc.maps.companions import ending
from missionc.maps.feature import Asked, Feature, MapError, unreadable, unusable
from missionc.maps.read_summary import Reading


@dataclass(frozen=True, slots=True)
class Form:
    """``module`` has a function of its own name; ``kinds`` are what it can hold, ``options`` what may be said of it."""

    says: str
    module: str
    kinds: tuple[str, ...]
    options: tuple[str, ...]


_GRID = Form("an occupancy grid", "occupancy_grid", ("obstacle",), ("resolution", "within", "unknown", "at", "named"))
_ALL = ("obstacle", "region", "beacon")

FORMS: dict[str, Form] = {
    **dict.fromkeys((".pgm", ".png", ".bmp", ".yaml", ".yml"), _GRID),
    **dict.fromkeys((".geojson", ".json"), Form("GeoJSON", "geojson", _ALL, ("origin", "unit", "at", "named"))),
    ".csv": Form("a table", "feature_table", _ALL, ("unit", "at", "named")),
    ".dxf": Form("a drawing", "drawing", _ALL, ("unit", "layer", "at", "named")),
}


def read_map(asked: Asked) -> list[Feature] | Diagnostic:
    """The features of a file, at least one; what is wrong with it where there is none."""
    source = asked.sources[0]
    form = FORMS.get(ending(source.name))
    try:
        if form is None:
            endings = ", ".join(f"`{each}`" for each in FORMS)
            raise unreadable(source, "its ending is that of no form that is known", asked.span, f"known are {endings}")
        module = import_module(f"missionc.maps.{form.module}")
        read: Callable[[Asked], list[Feature] | Reading] = getattr(module, form.module)
        reading = read(asked)
        features = reading.features if isinstance(reading, Reading) else reading
        if not features:
            way_out = "name another file, or say of its features what they are: `kind`"
            raise unusable(f"`{source.name}` has no {asked.kind}", asked.span, way_out)
    except MapError as error:
        return error.finding
    return features
