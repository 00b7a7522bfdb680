"""Drawings: areas, discs and points of a DXF file in world coordinates, seen from above.

    in   the file, the layers to read
    out  features in metres, in the order of the drawing, and what was omitted
    says MC004 MC033 MC034 MC035

Everything is counted before it is computed: entities with all blocks multiplied out, then corners with all arcs as
chords. Chords may lie inside their arcs, so obstacles are grown afterwards. An open outline bounds nothing, and is an
error rather than omitted: it may be a wall.

Source:
    Autodesk, "DXF Reference"; units come from the header's ``$INSUNITS``.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from io import BytesIO, TextIOWrapper
from typing import Any

import numpy as np

from missionc.base.diagnostics.map_error import MapError, too_many, unreadable, unsaid, unusable
from missionc.base.late_dataclass import Record
from missionc.base.source import Source
from missionc.frontend.maps.dxf.areas import GAP, SAGITTA, DrawingFrame, area_from, area_of, disc_of, join_ends, outline
from missionc.frontend.maps.dxf.blocks import Blocks, Parts, Placed, folded, layer_of
from missionc.frontend.maps.dxf.shapes import READ, Points, Shape, UnusableError, shape_of
from missionc.frontend.maps.feature import Area, Circle, Feature, MapPoint
from missionc.frontend.maps.map_metadata import library
from missionc.frontend.maps.read_map import Reading
from missionc.ir.places import FileRequest, LeftOut

FOOT = 0.3048
SURVEY_FOOT = 1200 / 3937
METRES: dict[float, float] = {
    **{1: FOOT / 12, 2: FOOT, 3: 5280 * FOOT, 8: FOOT / 12e6, 9: FOOT / 12e3, 10: 3 * FOOT},
    **{4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 13: 1e-6, 14: 0.1, 15: 10.0, 16: 100.0},
    **{21: SURVEY_FOOT, 22: SURVEY_FOOT / 12, 23: 3 * SURVEY_FOOT, 24: 5280 * SURVEY_FOOT},
}
"""Length of a drawing's unit in metres, by the number in ``$INSUNITS``; 0 means no unit."""

WRITE = "export the drawing as DXF text"
NO_AREA = (
    *("ATTDEF", "ATTRIB", "TEXT", "MTEXT", "ARC_DIMENSION", "DIMENSION", "LARGE_RADIAL_DIMENSION", "LEADER"),
    *("MULTILEADER", "MLEADER", "TOLERANCE", "POINT", "RAY", "XLINE", "IMAGE", "WIPEOUT", "VIEWPORT", "LIGHT", "SHAPE"),
)
"""Kinds of entities that bound no area; unsupported kinds that are not listed may bound one."""


def drawing(asked: FileRequest) -> Reading:
    """Features of a DXF drawing in the requested layers, in metres.

    Raises:
        MapError: the file is not a drawing, an entity in its layers gives no area, or there is too much.
    """
    source, limits = asked.sources[0], asked.limits
    lines = max(source.content.count(b"\n"), source.content.count(b"\r"))
    if lines > limits.map_lines:
        raise too_many(source, "lines", "map_lines", lines, limits, asked.span)
    document = _document(source, asked)
    unit = asked.unit or _unit(document)
    if not unit:
        message = f"`{source.name}` does not state the length of its unit: `$INSUNITS` is missing or is not a unit"
        raise unsaid(message, asked.span, "add the length of a unit, for example `unit 1 mm`")
    _check_layers(document, asked)
    with np.errstate(all="ignore"):  # numbers that are not finite are found when they are used
        return _Drawing(asked, source, unit).read(document)


def _document(source: Source, asked: FileRequest) -> Any:
    ezdxf = library("ezdxf", "ezdxf", source, asked.span)
    try:
        return ezdxf.read(TextIOWrapper(BytesIO(source.content), _encoding(source), errors="replace"))
    except Exception as error:  # the library fails in many ways on malformed files
        line = re.search(r"line: (\d+)", str(error))
        where = f", damaged near line {line[1]}" if line else ""
        raise unreadable(source, f"not a DXF drawing{where}", asked.span, WRITE) from None


def _encoding(source: Source) -> str:
    """Text encoding that the drawing's header states; UTF-8 if the header is damaged."""
    from ezdxf.filemanagement import dxf_stream_info

    try:
        return str(dxf_stream_info(TextIOWrapper(BytesIO(source.content), "latin-1")).encoding)
    except Exception:
        return "utf-8"


def _unit(document: Any) -> float:
    """Length of the drawing's unit in metres; 0 if the drawing does not state it."""
    number = document.header.get("$INSUNITS", 0)
    return METRES.get(number, 0.0) if isinstance(number, int | float) else 0.0


def _check_layers(document: Any, asked: FileRequest) -> None:
    """Check that each requested layer has an entry in the table of layers, or an entity.

    Raises:
        MapError: a layer does not exist.
    """
    if not asked.layers:
        return
    spaces = [document.modelspace(), *document.blocks]
    names = [layer_of(entity) for space in spaces for entity in space] + [layer.dxf.name for layer in document.layers]
    named = {folded(name): name for name in names}
    for layer in asked.layers:
        if folded(layer) not in named:
            listed = ", ".join(f"`{name[:80]}`" for name in sorted(set(named.values()))[:10])
            message = f"`{asked.sources[0].name}` has no layer `{layer[:80]}`"
            raise unsaid(message, asked.span, f"use one of the layers {listed}")


class Loose(Record):
    """Open line of an entity, (points, 2) in metres, with the entity's number."""

    number: int
    placed: Placed
    line: Points
    curved: bool


class _Drawing:
    def __init__(self, asked: FileRequest, source: Source, unit: float) -> None:
        self.asked, self.source = asked, source
        self.world = DrawingFrame(unit, asked.at, asked.limits.magnitude)

    def read(self, document: Any) -> Reading:
        try:
            blocks = Blocks(document, self.asked.layers, self.unread, self.asked.limits.nesting)
            left_out = Counter({part: number for part, number in blocks.parts.items() if part[1]})
            self.check_count("entities with blocks expanded", "map_features", blocks.parts.total() - left_out.total())
            placed = list(blocks)
        except UnusableError as error:
            raise unusable(f"`{self.source.name}`: {error}", self.asked.span, "correct the blocks") from None
        except MapError:
            raise
        except Exception:  # a library that reads what anybody wrote fails in many ways
            raise unreadable(self.source, "its blocks cannot be expanded", self.asked.span, WRITE) from None
        features = self.beacons(placed) if self.asked.kind == "beacon" else self.areas(placed, left_out)
        parts = tuple(LeftOut(*part, number) for part, number in sorted(left_out.items()))
        return Reading(features, parts, unit=self.world.unit)

    def unread(self, kind: str) -> str:
        """Reason why entities of a kind are not read; empty if they are."""
        if self.asked.kind == "beacon":
            return "" if kind == "POINT" else "not a point"
        return "" if kind in READ else "not an area" if kind in NO_AREA else "unsupported kind"

    def beacons(self, placed: list[Placed]) -> list[Feature]:
        features = []
        for each in placed:
            with self.about(each):
                ((x, y),) = self.world.metres(each.seen(np.array([each.entity.dxf.location.xyz])))
                features.append(self.feature(MapPoint((float(x), float(y)))))
        return features

    def areas(self, placed: list[Placed], left_out: Parts) -> list[Feature]:
        """Areas and discs of entities, in the order of the first entity of each.

        Entities that draw nothing are omitted.
        """
        shapes: dict[Any, Shape] = {}
        drawn, found, corners = list[Placed](), dict[int, Area | Circle](), 0
        count_corners = cache(lambda entity, tolerance: shapes[entity].corners(tolerance))
        for each in placed:
            with self.about(each):
                if each.entity not in shapes:
                    shapes[each.entity] = shape_of(each.entity)
                shape = shapes[each.entity]
                if shape.empty:
                    left_out[each.entity.dxftype(), "without extent"] += 1
                    continue
                disc = disc_of(each, shape, self.world)
                if disc:
                    found[len(drawn)] = disc
                else:
                    corners += count_corners(each.entity, self.world.tolerance(each))
                drawn.append(each)
        self.check_count("corners (arcs as chords)", "map_corners", corners)
        loose: dict[str, list[Loose]] = defaultdict(list)
        for number, each in enumerate(drawn):
            if number not in found:
                with self.about(each):
                    area, lines = area_of(each, shapes[each.entity], self.world, grown=self.grown)
                    found.update({number: area} if area else {})
                    loose[folded(each.layer)] += [
                        Loose(number, each, line, shapes[each.entity].curved) for line in lines
                    ]
        for group in loose.values():
            found.update(self.joined(group))
        return [self.feature(shape) for _, shape in sorted(found.items(), key=lambda each: each[0])]

    def joined(self, group: list[Loose]) -> Iterator[tuple[int, Area]]:
        """Yield areas whose outlines consist of open lines in one layer, each with the number of its first line.

        Raises:
            UnusableError: an outline is open.
        """
        rings, rest = join_ends([each.line for each in group], GAP) if group else ([], [])
        for at in rest[:1]:
            with self.about(group[at].placed):
                x, y = group[at].line[0]
                more = f", as are {len(rest) - 1} more" if len(rest) > 1 else ""
                way_out = f"close the outline to within {GAP * 1000:g} mm"
                raise UnusableError(f"is open at {x:g}, {y:g} m{more}", way_out)
        for ring in rings:
            lines = [group[at] for at in ring.lines]
            growth = ring.gap + SAGITTA * any(each.curved for each in lines) if self.grown else 0.0
            first = min(lines, key=lambda each: each.number)
            with self.about(first.placed):
                yield first.number, area_from([outline(ring.corners)], growth)

    @property
    def grown(self) -> bool:
        return self.asked.kind == "obstacle"

    def feature(self, shape: Area | Circle | MapPoint) -> Feature:
        return Feature("", shape, self.asked.span, self.asked.span)

    def check_count(self, what: str, limit: str, count: int) -> None:
        if count > getattr(self.asked.limits, limit):
            raise too_many(self.source, what, limit, count, self.asked.limits, self.asked.span)

    @contextmanager
    def about(self, part: Placed) -> Iterator[None]:
        """Context in which errors about a part of the drawing name its entity and layer.

        Raises:
            MapError: the part gives no area.
        """
        try:
            yield
        except UnusableError as error:
            name = f"{part.entity.dxftype()} in layer `{part.layer[:80]}`"
            raise unusable(f"`{self.source.name}`: {name} {error}", self.asked.span, error.way_out) from None
