"""Dispatch of map files to readers by the extension of the file's name, and the summary of the contents.

    in   FileRequest
    out  a reading, or the finding about the file
    says MC004 MC033 MC034 MC035 MC404

A summary has the number of features read, those omitted with the reasons, and the extents.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from importlib import import_module

from missionc.base.diagnostics.map_error import MapError, too_many, unreadable, unusable
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.frontend.maps.feature import Area, Circle, Feature, MapPoint
from missionc.frontend.maps.map_metadata import ending
from missionc.ir.places import Extents, FileRequest, LeftOut, ReadSummary

MOST_SHOWN = 4
"""Maximum number of kinds of omitted parts that a summary lists."""


class Reading(Record):
    """Features of a map file, and the parts that the reader omitted.

    Args:
        warnings: findings about parts that the author may have meant otherwise.
        frame: frame of a map that extends beyond its features.
        unit: metres in the unit that the file states; None if it states none.
    """

    features: list[Feature]
    left_out: tuple[LeftOut, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    frame: Extents | None = None
    unit: float | None = None

    def summary(self) -> ReadSummary:
        return ReadSummary(len(self.features), self.left_out, self.frame or extents(self.features))


def count_left_out(parts: Iterable[tuple[str, str]]) -> tuple[LeftOut, ...]:
    """Omitted parts with the number of equal ``(kind, reason)`` pairs, in alphabetical order."""
    return tuple(LeftOut(kind, reason, count) for (kind, reason), count in sorted(Counter(parts).items()))


def left_out_text(left_out: tuple[LeftOut, ...]) -> str:
    """Text such as ``; left out: 2 LineString (no polygon and no point)``; empty if nothing was omitted."""
    says = ", ".join(f"{each.count} {each.kind} ({each.reason})" for each in left_out[:MOST_SHOWN])
    more = f", and {len(left_out) - MOST_SHOWN} more kinds" if len(left_out) > MOST_SHOWN else ""
    return f"; left out: {says}{more}" if left_out else ""


def extents(features: Iterable[Feature]) -> Extents | None:
    """Bounding box of all features in the plane, or None if there are none."""
    return box(point for feature in features for point in _outermost(feature.shape))


def box(points: Iterable[tuple[float, ...]]) -> Extents | None:
    """Bounding box of all points in the plane, or None if there are none."""
    corners = [(point[0], point[1]) for point in points]
    if not corners:
        return None
    xs, ys = zip(*corners, strict=True)
    return (min(xs), min(ys)), (max(xs), max(ys))


def _outermost(shape: Area | Circle | MapPoint) -> list[tuple[float, float]]:
    match shape:
        case Area(polygons):
            return [corner for outer, *_ in polygons for corner in outer]
        case Circle((x, y), radius):
            return [(x - radius, y - radius), (x + radius, y + radius)]
        case MapPoint(position):
            return [(position[0], position[1])]


class Form(Record):
    """Format of a map file; ``module`` has a reader of the same name.

    ``kinds`` are the declarations that may read the format, and ``options`` its settings.
    """

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


def read_map(asked: FileRequest) -> Reading | Diagnostic:
    """Features of a map file, at least one, or a finding if the file is invalid or has none."""
    source = asked.sources[0]
    form = FORMS.get(ending(source.name))
    try:
        if form is None:
            endings = ", ".join(f"`{each}`" for each in FORMS)
            raise unreadable(source, "unknown file extension", asked.span, f"use one of {endings}")
        read: Callable[[FileRequest], Reading] = getattr(
            import_module(f"missionc.frontend.maps.{form.module}"), form.module
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings of the library are not findings
            reading = read(asked)
        summary = reading.summary()
        if summary.extents is None:
            way_out = "set the `kind` of its features"
            raise unusable(f"`{source.name}` has no {asked.kind}{left_out_text(summary.left_out)}", asked.span, way_out)
        if summary.count > asked.limits.map_features:
            raise too_many(source, "places", "map_features", summary.count, asked.limits, asked.span)
        low, high = summary.extents
        if not max(map(abs, (*low, *high))) <= asked.limits.magnitude:
            far = f"`{source.name}` has coordinates above {asked.limits.magnitude:g} m"
            raise unusable(far, asked.span, "check its unit, origin and resolution")
    except MapError as error:
        return error.finding
    return reading
