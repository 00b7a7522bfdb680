"""Drawings: closed outlines, circles and points of DXF to areas and places.

    in   the file, the layers that are meant
    out  features in metres, in the order of the drawing
    says MC004 MC033 MC034 MC035

Blocks are taken apart. Arcs become chords; an obstacle is then grown by what they may lie inside of the arc. An outline
that is open bounds nothing, and is refused rather than left out: it may be a wall.

Source:
    Autodesk, "DXF Reference"; its units are those of the header's ``$INSUNITS``.
"""

from __future__ import annotations

from io import BytesIO, TextIOWrapper
from typing import Any

import shapely

from missionc.base.source import Source
from missionc.maps.feature import Area, Asked, Circle, Feature, MapError, Place, too_many, unreadable, unsaid, unusable
from missionc.maps.libraries import library
from missionc.maps.read_summary import Reading

METRES = {1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 8: 2.54e-8, 9: 2.54e-5, 10: 0.9144}
"""Metres in a unit of a drawing, by the number that ``$INSUNITS`` gives it; 0 is none."""

SAGITTA = 0.01
"""Metres that a chord may lie inside of its arc."""

OUTLINES = ("LWPOLYLINE", "POLYLINE", "ELLIPSE", "SPLINE", "HATCH", "SOLID", "LINE", "ARC", "MPOLYGON")
WRITE = "write the drawing as DXF once more, as text"


def drawing(asked: Asked) -> Reading:
    """Raises:
    MapError: it is no drawing, or something in its layers is no place.
    """
    source = asked.sources[0]
    document = _document(source, asked)
    unit = asked.unit or METRES.get(int(document.header.get("$INSUNITS", 0)), 0.0)
    if not unit:
        message = f"what a unit of `{source.name}` is, the drawing does not say"
        raise unsaid(message, asked.span, "say it as in `unit 1 mm`")
    known = {layer.dxf.name for layer in document.layers}
    for layer in asked.layers:
        if layer not in known:
            listed = ", ".join(f"`{name}`" for name in sorted(known)[:10])
            raise unsaid(f"`{source.name}` has no layer `{layer[:80]}`", asked.span, f"its layers are {listed}")
    return Reading(_Drawing(asked, source, unit).read(document))


def _document(source: Source, asked: Asked) -> Any:
    ezdxf = library("ezdxf", "ezdxf", source, asked.span)
    try:
        text = TextIOWrapper(BytesIO(source.content), encoding="utf-8", errors="surrogateescape")
        return ezdxf.read(text)
    except Exception:  # a library that reads what anybody wrote fails in many ways
        raise unreadable(source, "it is no drawing in the form DXF", asked.span, WRITE) from None


class _Drawing:
    def __init__(self, asked: Asked, source: Source, unit: float) -> None:
        self.asked, self.source, self.unit = asked, source, unit

    def read(self, document: Any) -> list[Feature]:
        from ezdxf.disassemble import recursive_decompose

        limit, features, count = self.asked.limits.map_features, [], 0
        try:
            for entity in recursive_decompose(document.modelspace()):
                if self.asked.layers and entity.dxf.layer not in self.asked.layers:
                    continue
                count += 1
                if count > limit:
                    raise too_many(
                        self.source, "entities or more", "map_features", count, self.asked.limits, self.asked.span
                    )
                features += self.feature(entity)
        except MapError:
            raise
        except Exception:
            raise unreadable(self.source, "something in it cannot be taken apart", self.asked.span, WRITE) from None
        return features

    def feature(self, entity: Any) -> list[Feature]:
        """None of what is a text or a measure, and of points where areas are asked for."""
        kind, span = entity.dxftype(), self.asked.span
        if self.asked.kind == "beacon":
            if kind != "POINT":
                return []
            return [Feature("", Place(self.place(entity.dxf.location)), span, span)]
        if kind == "CIRCLE":
            circle = Circle(self.place(entity.dxf.center), float(entity.dxf.radius) * self.unit)
            return [Feature("", circle, span, span)]
        if kind not in OUTLINES:
            return []
        return [Feature("", Area(tuple(self.areas(entity))), span, span)]

    def place(self, point: Any) -> tuple[float, float]:
        x, y = self.asked.at[0] + float(point.x) * self.unit, self.asked.at[1] + float(point.y) * self.unit
        if not max(abs(x), abs(y)) <= self.asked.limits.magnitude:
            raise self.wrong(f"a point at {point.x:g}, {point.y:g} is too far away")
        return x, y

    def areas(self, entity: Any) -> list[tuple[tuple[tuple[float, float], ...], ...]]:
        from ezdxf import path

        rings = []
        for each in path.from_hatch(entity) if entity.dxftype() in ("HATCH", "MPOLYGON") else [path.make_path(entity)]:
            if not each.is_closed:
                at = self.place(each.start)
                raise self.wrong(
                    f"a {entity.dxftype()} in layer `{entity.dxf.layer}` at {at[0]:g}, {at[1]:g} m is open"
                )
            rings.append([self.place(point) for point in each.flattening(SAGITTA / self.unit)])
            if each.has_curves and self.asked.kind == "obstacle":
                grown = shapely.buffer(shapely.Polygon(rings[-1]), SAGITTA, join_style="mitre")
                rings[-1] = [(float(x), float(y)) for x, y in shapely.get_coordinates(grown)]
        merged = shapely.Polygon(rings[0]) if len(rings) == 1 else _even_odd(rings)
        if merged.is_empty or not shapely.is_valid(merged):
            raise self.wrong(f"a {entity.dxftype()} in layer `{entity.dxf.layer}` crosses itself, or has no area")
        return [
            tuple(tuple((float(x), float(y)) for x, y in ring.coords[:-1]) for ring in (part.exterior, *part.interiors))
            for part in shapely.get_parts(merged)
        ]

    def wrong(self, reason: str) -> MapError:
        way_out = "close or mend it, or name other layers with `layer`"
        return unusable(f"`{self.source.name}`: {reason}", self.asked.span, way_out)


def _even_odd(rings: list[list[tuple[float, float]]]) -> shapely.Geometry:
    """What lies within an odd number of rings, as a hatch is filled."""
    area = shapely.Polygon()
    for ring in rings:
        area = shapely.symmetric_difference(area, shapely.Polygon(ring))
    return area
