"""The forms of files that places are read from, by the endings of their names.

in   Asked
out  a reading, or the finding about the file
says MC004 MC033 MC034 MC035 MC404
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib import import_module

from missionc.base.late_dataclass import dataclass
from missionc.diagnostics.model import Diagnostic
from missionc.maps.companions import ending
from missionc.maps.feature import Asked, MapError, too_many, unreadable, unusable
from missionc.maps.read_summary import Reading, without


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


def read_map(asked: Asked) -> Reading | Diagnostic:
    """Read the features of a file, at least one; the finding about the file if there is none."""
    source = asked.sources[0]
    form = FORMS.get(ending(source.name))
    try:
        if form is None:
            endings = ", ".join(f"`{each}`" for each in FORMS)
            raise unreadable(source, "its ending is that of no form that is known", asked.span, f"known are {endings}")
        read: Callable[[Asked], Reading] = getattr(import_module(f"missionc.maps.{form.module}"), form.module)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what a library thinks of a file is no finding
            reading = read(asked)
        summary = reading.summary()
        if summary.extents is None:
            way_out = "name another file, or say of its features what they are: `kind`"
            raise unusable(f"`{source.name}` has no {asked.kind}{without(summary.left_out)}", asked.span, way_out)
        if summary.count > asked.limits.map_features:
            raise too_many(source, "places", "map_features", summary.count, asked.limits, asked.span)
        low, high = summary.extents
        if not max(map(abs, (*low, *high))) <= asked.limits.magnitude:
            far = f"`{source.name}` has places that are more than {asked.limits.magnitude:g} m away"
            raise unusable(far, asked.span, "check its unit, its origin and its resolution")
    except MapError as error:
        return error.finding
    return reading
