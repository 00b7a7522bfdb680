"""GeoJSON files: polygons and points with their properties, each with its location in the text.

    in   the text, the requested kind of features
    out  those features in metres
    says MC004 MC033 MC034 MC035 MC038

Only the properties ``name``, ``kind``, ``radius`` and ``height`` are read.

Source:
    RFC 7946. Coordinates are longitude and latitude; older files may have metres, which the mission must then state.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import shapely

from missionc.base.diagnostics.code import MAP_LEFT_OUT
from missionc.base.diagnostics.map_error import MapError, too_many, unreadable, unsaid, unusable
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.source import Source, Span
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.base.units import is_number, plain_number
from missionc.frontend.maps.feature import Area, Circle, Corners, Feature, MapPoint
from missionc.frontend.maps.local_frame import local_frame
from missionc.frontend.maps.read_map import Reading, count_left_out
from missionc.ir.places import FileRequest

KINDS = ("obstacle", "region", "beacon")
ALL = "FeatureCollection"
LINES = ("LineString", "MultiLineString")
GEOMETRIES = ("Point", "MultiPoint", *LINES, "Polygon", "MultiPolygon", "GeometryCollection")
COLLECTION = "write a `FeatureCollection` as in RFC 7946"
_FEATURES = re.compile(r'"features"\s*:\s*\[\s*')
_WGS_84 = re.compile(r"CRS ?84|4326", re.IGNORECASE)
"""Pattern of the names for coordinate systems with longitude and latitude on WGS 84."""
_COMMA = re.compile(r"\s*,?\s*")


def geojson(asked: FileRequest) -> Reading:
    """Features of the requested kind in a GeoJSON file, and features that state no kind.

    Raises:
        MapError: the file is not GeoJSON, or a feature in it gives no shape or point.
    """
    source = asked.sources[0]
    try:
        root = parse_json(source.text, asked.limits.json_values, finite=False)
    except NotJsonError as error:
        raise unreadable(source, error.reason, Span(source, error.place, error.place), COLLECTION) from None
    form = root.get("type") if isinstance(root, dict) else None
    if form in GEOMETRIES:
        root = {"type": "Feature", "properties": {}, "geometry": root}
    listed = [root] if form == "Feature" or form in GEOMETRIES else root.get("features") if form == ALL else None
    if not isinstance(listed, list):
        raise unreadable(source, "not a `FeatureCollection`", Span(source, 0, 0), COLLECTION)
    if len(listed) > asked.limits.map_features:
        raise too_many(source, "features", "map_features", len(listed), asked.limits, asked.span)
    corners = _corner_count(listed)
    if corners > asked.limits.map_corners:
        raise too_many(source, "corners", "map_corners", corners, asked.limits, asked.span)
    metres = _metres(asked, source, root.get("crs"))
    spans = _spans(source, len(listed)) if form == ALL else [Span(source, 0, len(source.text))]
    left_out: list[_Part] = []
    readers = [_Reader(asked, metres, span, left_out) for span in spans]
    features = [each for reader, feature in zip(readers, listed, strict=True) for each in reader.read(feature)]
    return Reading(
        features, count_left_out((part.kind, part.reason) for part in left_out), tuple(_warnings(source, left_out))
    )


def _corner_count(features: Sequence[object]) -> int:
    """Number of coordinate pairs in the geometries of all features."""
    unread: list[object] = [each.get("geometry") for each in features if isinstance(each, dict)]
    count = 0
    while unread:
        match unread.pop():
            case {**geometry}:
                unread += (geometry.get("coordinates"), geometry.get("geometries"))
            case [int() | float(), *_]:
                count += 1
            case [*parts]:
                unread += parts
    return count


def _metres(asked: FileRequest, source: Source, system: object) -> Callable[[float, float], tuple[float, float]]:
    """Function from coordinates in the file to the mission's metres.

    Args:
        system: member `crs` of files older than RFC 7946.

    Raises:
        MapError: the declaration does not fit the file's coordinate system.
    """
    named = json.dumps(system) if system else ""
    if asked.origin is not None and named and not _WGS_84.search(named):
        raise unsaid(
            f"the coordinates in `{source.name}` are not longitude and latitude: its `crs` is {named[:80]}",
            asked.span,
            "convert the file to WGS 84",
        )
    if asked.origin is not None and asked.unit is not None:
        raise unsaid("both `origin` and `unit` are given", asked.span,
                     "delete `origin` or `unit`")  # fmt: skip
    if asked.origin is None and asked.unit is None:
        raise unsaid(
            f"the coordinates in `{source.name}` have neither an origin nor a unit",
            asked.span,
            "add `unit 1 m` for metres, or, for example, `origin (8.54 deg, 47.38 deg)` for longitude and latitude",
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
    """Source span of each feature in the text."""
    decoder, text, spans = json.JSONDecoder(), source.text, []
    begins = _FEATURES.search(text)
    at = begins.end() if begins else 0
    for _ in range(count):
        try:
            _, end = decoder.raw_decode(text, at)
        except (json.JSONDecodeError, RecursionError):  # an earlier `features` belongs to another object
            return [Span(source, 0, 0)] * count
        spans.append(Span(source, at, end))
        at = _COMMA.match(text, end).end()  # type: ignore[union-attr]
    return spans


class _Part(Record):
    """Part of a file that gives no shape or point; ``help`` is empty if another declaration may read it."""

    kind: str
    reason: str
    span: Span
    help: str


def _warnings(source: Source, left_out: list[_Part]) -> Iterator[Diagnostic]:
    """Yield a finding for each kind of omitted part, located at the first one."""
    kinds: dict[tuple[str, str], list[_Part]] = {}
    for part in left_out:
        if part.help:
            kinds.setdefault((part.kind, part.reason), []).append(part)
    for (kind, reason), (first, *others) in kinds.items():
        says = f"`{source.name}`: left out {1 + len(others)} `{kind}`: {reason}"
        yield Diagnostic(MAP_LEFT_OUT, says, Label(first.span), help=first.help)


class _Reader(Record):
    """Reader of one feature, located at ``span``; it appends unusable parts to ``left_out``."""

    asked: FileRequest
    metres: Callable[[float, float], tuple[float, float]]
    span: Span
    left_out: list[_Part]

    def read(self, feature: object) -> Iterator[Feature]:
        """Yield the shapes and points of a feature; none if it is of another kind.

        Raises:
            MapError: the value is not a valid feature.
        """
        record = feature if isinstance(feature, dict) else {}
        properties = record.get("properties") or {}
        if record.get("type") != "Feature" or not isinstance(properties, dict):
            raise self.wrong("not a `Feature`")
        kind, name, geometry = properties.get("kind"), properties.get("name"), record.get("geometry")
        if geometry is not None and not isinstance(geometry, dict):
            raise self.wrong("not a `Feature` with a geometry")
        form = str(geometry.get("type", "Feature"))[:40] if geometry else "Feature"
        if kind not in (None, *KINDS):
            known = ", ".join(f"`{each}`" for each in KINDS)
            way_out = f"change the `kind` {_json(kind)}"
            self.leave_out(form, f"its `kind` is not one of {known}", way_out)
        if kind not in (None, self.asked.kind):
            return
        if name is not None and not isinstance(name, str):
            raise self.wrong("expected a text as name")
        shapes = list(self.shapes(geometry, properties))
        height = self.height(properties) if shapes else None
        for shape in shapes:
            yield Feature(name or "", shape, self.span.first_line, self.named(name), height)

    def shapes(self, geometry: dict[str, Any] | None, properties: dict[str, Any]) -> Iterator[Area | Circle | MapPoint]:
        """Yield the points of a geometry one by one, and all its polygons as one area."""
        polygons: list[tuple[Corners, ...]] = []
        waiting: list[Any] = [geometry]
        while waiting:
            part = waiting.pop()
            form = part.get("type") if isinstance(part, dict) else None
            inside = part.get("geometries" if form == "GeometryCollection" else "coordinates") if form else None
            if part is None or inside == []:
                self.no_place("Feature", "its geometry is empty", properties)
            elif form not in GEOMETRIES:
                raise self.wrong(f"unknown geometry {_json(form)}")
            elif form == "GeometryCollection":
                waiting += reversed(self.listed(inside))
            elif form in ("Point", "MultiPoint"):
                for position in [inside] if form == "Point" else self.listed(inside):
                    yield from self.point(position, properties)
            elif form in LINES:
                self.no_place(form, "neither a polygon nor a point", properties)
            elif self.asked.kind == "beacon":
                self.no_place(form, "a beacon needs a point", properties, another=True)
            else:
                parts = self.listed(inside) if form == "MultiPolygon" else [inside]
                polygons += [self.polygon(each) for each in parts]
        if polygons:
            yield Area(tuple(polygons))

    def point(self, position: object, properties: dict[str, Any]) -> Iterator[Circle | MapPoint]:
        if self.asked.kind == "beacon":
            yield MapPoint((*self.position(position), *self.altitude(position)))
            return
        sizes = {key.lower(): value for key, value in properties.items() if value is not None}
        if "radius" in sizes:
            radius = self.number(sizes["radius"])
            if radius <= 0:
                raise self.wrong("the radius must be above 0")
            yield Circle(self.position(position), radius)
            return
        near = next((key for key in sizes if "radius" in key or "diameter" in key), "")
        reason = "a point needs a `radius`, in metres" + (f"; found `{near[:40]}`" if near else "")
        self.no_place("Point", reason, properties, another=not near)

    def no_place(self, form: str, reason: str, properties: dict[str, Any], *, another: bool = False) -> None:
        """Record a geometry that gives no shape or point as omitted.

        Args:
            another: True if another kind of declaration can use it.

        Raises:
            MapError: the feature states its kind, so that it must be used.
        """
        way_out = "add a `radius`, in metres" if form == "Point" else "replace the geometry by a polygon"
        if properties.get("kind") is not None:
            raise self.wrong(f"`{form}`: {reason}", way_out)
        self.leave_out(form, reason, "" if another else way_out)

    def leave_out(self, kind: str, reason: str, way_out: str) -> None:
        self.left_out.append(_Part(kind, reason, self.span.first_line, way_out))

    def listed(self, value: object) -> list[Any]:
        if not isinstance(value, list):
            raise self.wrong("no coordinates found")
        return value

    def polygon(self, rings: object) -> tuple[Corners, ...]:
        if not isinstance(rings, list) or not rings:
            raise self.wrong("expected a list of rings")
        made = tuple(self.ring(ring) for ring in rings)
        if not shapely.is_valid(shapely.Polygon(made[0], made[1:])):
            raise self.wrong("the polygon crosses itself or has a hole outside of it")
        return made

    def ring(self, ring: object) -> Corners:
        if not isinstance(ring, list) or len(ring) < 4 or ring[0] != ring[-1]:
            raise self.wrong("a ring needs at least four positions, the last equal to the first")
        corners = [self.position(position) for position in ring[:-1]]
        kept = tuple(each for each, before in zip(corners, [corners[-1], *corners], strict=False) if each != before)
        if len(kept) < 3:
            raise self.wrong("a ring needs at least three different corners")
        return kept

    def position(self, position: object) -> tuple[float, float]:
        if not isinstance(position, list) or not 2 <= len(position) <= 3:
            raise self.wrong("expected a position with two or three numbers")
        first, second = self.number(position[0]), self.number(position[1])
        if self.asked.origin is not None and not (abs(first) <= 180 and abs(second) <= 90):
            way_out = "write `unit 1 m` in place of `origin` for coordinates in metres"
            raise self.wrong(f"{first:g}, {second:g} are not a longitude and a latitude", way_out)
        x, y = self.metres(first, second)
        if not (math.isfinite(x) and math.isfinite(y) and max(abs(x), abs(y)) <= self.asked.limits.magnitude):
            raise self.wrong(f"the position {first:g}, {second:g} is too far from the origin")
        return x, y

    def altitude(self, position: object) -> tuple[float, ...]:
        if not isinstance(position, list) or len(position) != 3:
            return ()
        return () if self.flat("altitude") else (self.number(position[2]),)

    def height(self, properties: dict[str, Any]) -> tuple[float, float] | None:
        """Altitude range from the property ``height``, metres: from the ground to a number, or a list of lower and
        upper end.
        """
        value = properties.get("height")
        if value is None or self.flat("height"):
            return None
        low, high = value if isinstance(value, list) and len(value) == 2 else (0.0, value)
        return self.number(low), self.number(high)

    def flat(self, what: str) -> bool:
        """Return whether heights are omitted because the world is a plane; ``what`` is their name in the warning."""
        if self.asked.plane:
            self.leave_out(what, "the world is a plane", "")
        return self.asked.plane

    def number(self, value: object) -> float:
        """Value of a JSON number, or of a text such as ``12 m``.

        Raises:
            MapError: the value is not a number, or too large.
        """
        number = plain_number(value.strip().removesuffix("m").rstrip()) if isinstance(value, str) else value
        if not is_number(number):
            raise self.wrong(f"{_json(value)} is not a number")
        if abs(number) > self.asked.limits.magnitude:
            raise self.wrong(f"{_json(value)} is too large")
        return float(number)

    def named(self, name: str | None) -> Span:
        """Source span of the feature's name in the text, or of its first line."""
        at = self.span.text.find(json.dumps(name, ensure_ascii=False)) if name else -1
        if at < 0 or name is None:
            return self.span.first_line
        start = self.span.start + at + 1
        return self.span.part(start, start + len(name))

    def wrong(self, reason: str, way_out: str = "correct the file") -> MapError:
        return unusable(f"`{self.span.source.name}`: {reason}", self.span.first_line, way_out)


def _json(value: object) -> str:
    """First characters of a value in JSON, as a quotation for messages."""
    return f"`{json.dumps(value, ensure_ascii=False)[:40]}`"
