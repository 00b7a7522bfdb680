"""GeoJSON: polygons and points with their properties, each with its place in the text.

    in   the text, the kind of features that is asked for
    out  those features in metres
    says MC004 MC033 MC034 MC035

``name``, ``kind``, ``radius`` and ``height`` are read of the properties, and no others.

Source:
    RFC 7946. Coordinates are longitude and latitude; older files may have metres, and a mission then says so.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from typing import Any

import shapely

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Source, Span
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.maps.feature import (
    Area,
    Asked,
    Circle,
    Corners,
    Feature,
    MapError,
    Place,
    too_many,
    unreadable,
    unsaid,
    unusable,
)
from missionc.maps.local_frame import local_frame

KINDS = ("obstacle", "region", "beacon")
COLLECTION = "give a `FeatureCollection`, as RFC 7946 has it"
_FEATURES = re.compile(r'"features"\s*:\s*\[\s*')
_COMMA = re.compile(r"\s*,?\s*")


def geojson(asked: Asked) -> list[Feature]:
    """The features of the kind that is asked for, and those that have none.

    Raises:
        MapError: it is no GeoJSON, or something in it makes no place.
    """
    source = asked.sources[0]
    try:
        root = parse_json(source.text, asked.limits.json_values)
    except NotJsonError as error:
        raise unreadable(source, error.reason, Span(source, error.place, error.place), COLLECTION) from None
    listed = root.get("features") if isinstance(root, dict) and root.get("type") == "FeatureCollection" else None
    if not isinstance(listed, list):
        raise unreadable(source, "it is no `FeatureCollection`", Span(source, 0, 0), COLLECTION)
    if len(listed) > asked.limits.map_features:
        raise too_many(source, "features", "map_features", len(listed), asked.limits, asked.span)
    corners = sum(len(ring) for feature in listed for ring in _rings(feature))
    if corners > asked.limits.map_corners:
        raise too_many(source, "corners", "map_corners", corners, asked.limits, asked.span)
    spans = _spans(source, len(listed))
    metres = _metres(asked, source)
    made = [_Reader(asked, metres, span).read(feature) for feature, span in zip(listed, spans, strict=True)]
    return [feature for feature in made if feature is not None]


def _rings(feature: object) -> Iterator[list[object]]:
    """The rings of a feature's polygons, as far as they are lists."""
    geometry = feature.get("geometry") if isinstance(feature, dict) else None
    inside = geometry.get("coordinates") if isinstance(geometry, dict) else None
    polygons = inside if isinstance(geometry, dict) and geometry.get("type") == "MultiPolygon" else [inside]
    for rings in polygons if isinstance(polygons, list) else []:
        yield from (ring for ring in rings if isinstance(ring, list)) if isinstance(rings, list) else ()


def _metres(asked: Asked, source: Source) -> Callable[[float, float], tuple[float, float]]:
    """What coordinates of the file are in the mission's metres."""
    if asked.origin is not None and asked.unit is not None:
        raise unsaid("coordinates are longitude and latitude, or have a unit of length; both are said", asked.span,
                     "leave `origin` or `unit` out")  # fmt: skip
    if asked.origin is None and asked.unit is None:
        raise unsaid(
            f"what the coordinates in `{source.name}` are, nobody says",
            asked.span,
            "say where longitude and latitude are taken from, as in `origin (8.54 deg, 47.38 deg)`, or that they are "
            "metres, with `unit 1 m`",
        )
    unit, (x, y) = asked.unit or 1.0, asked.at
    frame = (
        local_frame(asked.origin, source, asked.span) if asked.origin is not None else lambda a, b: (a * unit, b * unit)
    )

    def metres(first: float, second: float) -> tuple[float, float]:
        east, north = frame(first, second)
        return x + east, y + north

    return metres


def _spans(source: Source, count: int) -> list[Span]:
    """Where each feature is in the text."""
    decoder, text, spans = json.JSONDecoder(), source.text, []
    begins = _FEATURES.search(text)
    at = begins.end() if begins else 0
    for _ in range(count):
        try:
            _, end = decoder.raw_decode(text, at)
        except (json.JSONDecodeError, RecursionError):  # an earlier `features` is somebody else's
            return [Span(source, 0, 0)] * count
        spans.append(Span(source, at, end))
        at = _COMMA.match(text, end).end()  # type: ignore[union-attr]
    return spans


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads one feature, which is at ``span``."""

    asked: Asked
    metres: Callable[[float, float], tuple[float, float]]
    span: Span

    def read(self, feature: object) -> Feature | None:
        """The feature; None where it is of another kind."""
        record = feature if isinstance(feature, dict) else {}
        properties, geometry = record.get("properties") or {}, record.get("geometry")
        if record.get("type") != "Feature" or not isinstance(properties, dict) or not isinstance(geometry, dict):
            raise self.wrong("this is no `Feature` with a geometry")
        kind, name = properties.get("kind"), properties.get("name")
        if kind not in (None, *KINDS):
            known = ", ".join(f"`{each}`" for each in KINDS)
            raise self.wrong(f"`{str(kind)[:40]}` is no kind of place", f"the kinds are {known}")
        if kind not in (None, self.asked.kind):
            return None
        if name is not None and not isinstance(name, str):
            raise self.wrong("a name is a text")
        shape = self.shape(geometry, properties)
        return Feature(name or "", shape, self.head(), self.named(name), self.height(properties)) if shape else None

    def shape(self, geometry: dict[str, Any], properties: dict[str, Any]) -> Area | Circle | Place | None:
        """None where this geometry is none of what is asked for, and the feature says no kind."""
        kind, inside = geometry.get("type"), geometry.get("coordinates")
        point, beacons, said = kind == "Point", self.asked.kind == "beacon", "kind" in properties
        if kind not in ("Point", "Polygon", "MultiPolygon"):
            raise self.wrong(f"`{str(kind)[:40]}` is no polygon and no point", "leave it out, or make it a polygon")
        if point != beacons and not (point and "radius" in properties):
            if not said:
                return None
            wanted = "a beacon is a point" if beacons else "a point makes an area with a `radius`, in metres"
            raise self.wrong(f"{wanted}; this is a `{kind}`", "change its geometry or its `kind`")
        if point and beacons:
            return Place((*self.position(inside), *self.altitude(inside)))
        if point:
            radius = self.number(properties["radius"])
            if radius <= 0:
                raise self.wrong("a radius is more than 0")
            return Circle(self.position(inside), radius)
        parts = inside if kind == "MultiPolygon" else [inside]
        if not isinstance(parts, list) or not parts:
            raise self.wrong("it has no coordinates")
        return Area(tuple(self.polygon(part) for part in parts))

    def polygon(self, rings: object) -> tuple[Corners, ...]:
        if not isinstance(rings, list) or not rings:
            raise self.wrong("a polygon is a list of rings")
        made = tuple(self.ring(ring) for ring in rings)
        if not shapely.is_valid(shapely.Polygon(made[0], made[1:])):
            raise self.wrong("the polygon crosses itself, or a hole of it lies outside")
        return made

    def ring(self, ring: object) -> Corners:
        if not isinstance(ring, list) or len(ring) < 4 or ring[0] != ring[-1]:
            raise self.wrong("a ring has four positions at least, the last of which is the first one")
        corners = [self.position(position) for position in ring[:-1]]
        kept = tuple(each for each, before in zip(corners, [corners[-1], *corners], strict=False) if each != before)
        if len(kept) < 3:
            raise self.wrong("a ring has three corners at least that are not the same")
        return kept

    def position(self, position: object) -> tuple[float, float]:
        if not isinstance(position, list) or not 2 <= len(position) <= 3:
            raise self.wrong("a position is a list of two or three numbers")
        first, second = self.number(position[0]), self.number(position[1])
        if self.asked.origin is not None and not (abs(first) <= 180 and abs(second) <= 90):
            way_out = "if these are metres, write `unit 1 m` in place of `origin`"
            raise self.wrong(f"{first:g}, {second:g} are no longitude and latitude", way_out)
        x, y = self.metres(first, second)
        if not (math.isfinite(x) and math.isfinite(y) and max(abs(x), abs(y)) <= self.asked.limits.magnitude):
            raise self.wrong(f"{first:g}, {second:g} is too far away")
        return x, y

    def altitude(self, position: object) -> tuple[float, ...]:
        return (self.number(position[2]),) if isinstance(position, list) and len(position) == 3 else ()

    def height(self, properties: dict[str, Any]) -> tuple[float, float] | None:
        """``height``: metres from the ground, or a list of the lower and the upper end."""
        value = properties.get("height")
        if value is None:
            return None
        low, high = value if isinstance(value, list) and len(value) == 2 else (0.0, value)
        return self.number(low), self.number(high)

    def number(self, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.wrong(f"`{str(value)[:40]}` is no number")
        if abs(value) > self.asked.limits.magnitude:
            raise self.wrong(f"`{str(value)[:40]}` is too large")
        return float(value)

    def named(self, name: str | None) -> Span:
        """Where its name is written."""
        at = self.span.text.find(json.dumps(name, ensure_ascii=False)) if name else -1
        if at < 0 or name is None:
            return self.head()
        start = self.span.start + at + 1
        return Span(self.span.source, start, start + len(name))

    def head(self) -> Span:
        """The first line of it."""
        line = self.span.source.text.find("\n", self.span.start, self.span.end)
        return Span(self.span.source, self.span.start, self.span.end if line < 0 else line)

    def wrong(self, reason: str, way_out: str = "mend the file, or leave this out of it") -> MapError:
        return unusable(f"`{self.span.source.name}`: {reason}", self.head(), way_out)
