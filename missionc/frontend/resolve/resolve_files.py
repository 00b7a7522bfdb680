"""Resolution of map files: declarations as if written in the mission, and a summary of each file.

    in   Program
    out  Program with the features of the files as declarations, findings, and a summary of each file
    says MC013 MC034 MC035 MC206 MC210, and the codes of ``maps``

The declarations that name files stay in addition to those generated from them, so that the names in them count as used.
A generated declaration has the span of the declaration that names the file. Its names and shapes have their spans in
the file, if that is text. A summary has the features and lanes of the file, those omitted with the reasons, and the
extents.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import reduce
from posixpath import basename, splitext
from typing import TYPE_CHECKING, TypeVar

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Span
from missionc.base.trace import counted
from missionc.base.units import Dimension
from missionc.frontend.resolve.context import Context, collect
from missionc.frontend.resolve.resolve_quantities import resolve_parameters, resolved_number
from missionc.frontend.resolve.resolve_settings import known_settings, relation, said_twice, unknown_word
from missionc.frontend.resolve.resolve_shapes import known, plane_point
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.read_file import named_files
from missionc.frontend.syntax.tokens import nameable, reserved
from missionc.ir.wording import point

if TYPE_CHECKING:
    from missionc.frontend.maps.feature import Area, Circle, Corners, Feature
    from missionc.frontend.maps.table import PointRow
    from missionc.ir.places import FileRequest


def file_lines(mission: ir.Mission) -> list[str]:
    """Lines that summarise each file and kind of feature; empty for a mission without files."""
    return [_line(file, lanes) for file, lanes in _files(mission)]


def file_records(mission: ir.Mission) -> list[dict[str, object]]:
    """JSON values that summarise each file; ``lanes`` is null except for roadmaps.

    ``low`` and ``high`` are the corners of the extents in metres, null without extents.
    """
    return [_record(file, lanes) for file, lanes in _files(mission)]


def _record(file: ir.PlacesFile, lanes: int | None) -> dict[str, object]:
    low, high = file.summary.extents or (None, None)
    return {
        "file": file.path,
        "kind": file.kind,
        "count": file.summary.count,
        "lanes": lanes,
        "left_out": [{"kind": each.kind, "reason": each.reason, "count": each.count} for each in file.summary.left_out],
        "low": low and [round(value, 9) for value in low],
        "high": high and [round(value, 9) for value in high],
    }


def _files(mission: ir.Mission) -> Iterator[tuple[ir.PlacesFile, int | None]]:
    """Yield the files of a mission, each with its number of lanes if it is a roadmap."""
    yield from ((file, None) for file in mission.files)
    if mission.solve.roadmap is not None:
        from missionc.frontend.maps.read_map import box  # few missions have one
        from missionc.ir.places import ReadSummary  # few missions have one

        roadmap = mission.solve.roadmap
        extents = box(node.position for node in roadmap.nodes)
        yield ir.PlacesFile(roadmap.path, "node", ReadSummary(len(roadmap.nodes), (), extents)), len(roadmap.lanes)


def _line(file: ir.PlacesFile, lanes: int | None) -> str:
    """Summary of a file, such as ``hall.yaml: 3 obstacles, (0, 0) to (10, 5) m; left out: 2 TEXT (not an area)``."""
    from missionc.frontend.maps.read_map import left_out_text  # few missions read files

    between = f", {' to '.join(map(point, file.summary.extents))} m" if file.summary.extents else ""
    of_lanes = "" if lanes is None else f", {counted(lanes, 'lane')}"
    left_out = left_out_text(file.summary.left_out)
    return f"{file.path}: {counted(file.summary.count, file.kind)}{of_lanes}{between}{left_out}"


KINDS = {"obstacles": "obstacle", "regions": "region", "beacons": "beacon"}
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9_]")
SETTINGS = ("resolution", "within", "unit")
UNKNOWN = ("free", "occupied")
Item = TypeVar("Item", bound="ast.TeamItem | ast.Pads")


def with_places(
    program: ast.Program, overrides: Mapping[str, str], limits: Limits
) -> tuple[ast.Program, list[Diagnostic], list[ir.PlacesFile]]:
    """The program with the features of its files as declarations, findings, and a summary of each file.

    A program without files is returned unchanged.
    """
    if not any(named_files(each) for each in program.declarations):
        return program, [], []
    parameters = tuple(
        each for each in program.declarations if isinstance(each, ast.Param) and isinstance(each.name, ast.Name)
    )
    context = Context(collect(replace(program, declarations=parameters), []), limits, [])
    resolve_parameters(context, dict(overrides))
    context.findings.clear()  # reported by the caller that resolves the whole
    worlds = [each for each in program.declarations if isinstance(each, ast.World)]
    context.dimension = len(worlds[0].low.coordinates) if worlds else 0
    made = [each for declaration in program.declarations for each in _made(context, declaration)]
    return replace(program, declarations=tuple(made)), context.findings, context.files


def _made(context: Context, declaration: ast.Declaration) -> Iterator[ast.Declaration]:
    """Yield the declarations that replace a declaration."""
    match declaration:
        case ast.FromFile():
            yield declaration
            asked = _asked(context, declaration)
            if asked is not None and asked.sources:
                yield from _places(context, declaration, asked)
        case ast.Obstacle(motion=ast.AlongFile(span, file)):
            rows = _rows(context, file, timed=True)
            waypoints = [
                ast.Waypoint(row.span, ast.Number(row.span, row.time), _numbers(row.position, row.span)) for row in rows
            ]
            yield replace(declaration, motion=ast.Along(span, tuple(waypoints)) if waypoints else None)
        case ast.Formation(offsets=ast.File() as file):
            yield replace(declaration, offsets=_points(context, file) or file)
        case ast.Team(items=items):
            yield replace(declaration, items=tuple(_item(context, item) for item in items))
        case _:
            yield declaration


def _item(context: Context, item: Item) -> Item:
    match item:
        case (
            ast.Start(places=ast.AtListed(span, file))
            | ast.Finish(places=ast.AtListed(span, file))
            | ast.Pads(places=ast.AtListed(span, file))
        ):
            points = _points(context, file)
            return replace(item, places=ast.AtPoints(span, points)) if points else item
        case ast.Flight(items=items):
            return replace(item, items=tuple(_item(context, each) for each in items))
        case _:
            return item


# --------------------------------------------------------------------- points


def _rows(context: Context, file: ast.File, *, timed: bool = False) -> list[PointRow]:
    if not file.sources:
        return []
    from missionc.frontend.maps.read_map import box
    from missionc.frontend.maps.table import point_table  # few missions have one
    from missionc.ir.places import ReadSummary

    rows = point_table(file.sources[0], file.span, context.limits, timed=timed)
    if isinstance(rows, Diagnostic):
        context.findings.append(rows)
        return []
    summary = ReadSummary(len(rows), (), box(row.position for row in rows))
    context.files.append(ir.PlacesFile(file.path, "point", summary))
    return rows


def _points(context: Context, file: ast.File) -> tuple[ast.Point, ...]:
    return tuple(ast.Point(row.span, _numbers(row.position, row.span)) for row in _rows(context, file))


def _numbers(values: Iterable[float], span: Span) -> tuple[ast.Number, ...]:
    return tuple(ast.Number(span, value) for value in values)


# -------------------------------------------------------------------- options


def _asked(context: Context, node: ast.FromFile) -> FileRequest | None:
    """Request for the file of a declaration; None if the declaration is invalid, which is reported."""
    from missionc.frontend.maps.map_metadata import ending
    from missionc.frontend.maps.read_map import FORMS
    from missionc.ir.places import FileRequest

    before = len(context.findings)
    form, kind = FORMS.get(ending(node.file.path)), KINDS[node.kind]
    if form is None:
        return FileRequest(kind, node.file.sources, node.file.span, context.limits)
    if kind not in form.kinds:
        holds = " and ".join(f"{each}s" for each in form.kinds)
        _not_for(context, f"{form.says} has only {holds}", node.span, "use another kind of file")
    allowed = tuple(name for name in SETTINGS if name in form.options)
    settings = known_settings(context, node.settings, allowed, form.says)
    options = _options(context, node, form.options, form.says)
    lengths = {name: _length(context, setting) for name, setting in settings.items()}
    for again in node.heights[1:]:
        said_twice(context, "`height`", again.span, node.heights[0].span)
    if node.heights and kind == "beacon":
        _not_for(context, "a beacon has no `height`", node.heights[0].span, "delete the height")
    at = options.get("at")
    place = plane_point(context, at, "where a file is put", "") if isinstance(at, ast.Point) else (0.0, 0.0)
    origin = options.get("origin")
    angles = _origin(context, origin) if isinstance(origin, ast.Point) else None
    words = options.get("unknown", ())
    if isinstance(words, tuple) and words and words[0] not in UNKNOWN:
        unknown_word(context, ast.Name(node.span, words[0]), UNKNOWN, "`unknown`", "word")
    if len(context.findings) > before:
        return None
    layers = options.get("layer", ())
    return FileRequest(
        kind,
        node.file.sources,
        node.file.span,
        context.limits,
        place,
        angles,
        lengths.get("unit"),
        lengths.get("resolution"),
        lengths.get("within"),
        layers if isinstance(layers, tuple) else (),
        words == ("free",),
        context.dimension == 2,
    )


def _options(
    context: Context, node: ast.FromFile, allowed: tuple[str, ...], form: str
) -> dict[str, ast.Point | tuple[str, ...]]:
    found: dict[str, ast.FileOption] = {}
    for option in node.options:
        if option.word not in allowed:
            _not_for(context, f"{form} takes no `{option.word}`", option.span, "delete the option")
        elif option.word in found:
            said_twice(context, f"`{option.word}`", option.span, found[option.word].span)
        else:
            found[option.word] = option
    return {word: option.value for word, option in found.items()}


def _length(context: Context, setting: ast.Setting) -> float:
    relation(context, setting, "")
    name = setting.name.text
    value = resolved_number(context, setting.high, Dimension.LENGTH, f"the `{name}` of a file")
    if value <= 0:
        message = f"the `{name}` of a file is {value:g} m; it must be above 0 m"
        context.report(code.VALUE_OUT_OF_RANGE, message, setting.high.span, help="write a length above 0 m")
    return value


def _origin(context: Context, point: ast.Point) -> tuple[float, float]:
    """Longitude and latitude of an origin, degrees; NaN if it is invalid, which is reported."""
    way_out = "write longitude and latitude, for example `origin (8.54 deg, 47.38 deg)`"
    if len(point.coordinates) != 2:
        _not_for(context, "expected a longitude and a latitude", point.span, way_out)
        return math.nan, math.nan
    values = [resolved_number(context, each, Dimension.ANGLE, "the origin") for each in point.coordinates]
    longitude, latitude = (round(math.degrees(value), 12) for value in values)
    if known((longitude, latitude)) and not (abs(longitude) <= 180 and abs(latitude) <= 90):
        _not_for(
            context, f"{longitude:g} deg, {latitude:g} deg are not a longitude and a latitude", point.span, way_out
        )
    return longitude, latitude


# --------------------------------------------------------------------- places


def _places(context: Context, node: ast.FromFile, asked: FileRequest) -> Iterator[ast.Declaration]:
    from missionc.frontend.maps.read_map import read_map

    reading = read_map(asked)
    if isinstance(reading, Diagnostic):
        context.findings.append(reading)
        return
    context.findings += [each for each in reading.warnings if each not in context.findings]
    prefix = next((words[0] for word, words in _words(node) if word == "named"), "")
    stem = prefix or _name(splitext(basename(node.file.path))[0])
    texts = _texts(reading.features, stem, f"{prefix}_" if prefix else "")
    for feature, text in zip(reading.features, texts, strict=True):
        if feature.name and (not nameable(text) or reserved(text)):
            _not_a_name(context, feature)
        yield from _place(node, feature, ast.Name(feature.name_span, text))
    asked = replace(asked, unit=asked.unit or reading.unit)
    context.files.append(ir.PlacesFile(node.file.path, asked.kind, reading.summary(), frozenset(texts), asked))


def _texts(features: list[Feature], stem: str, prefix: str) -> list[str]:
    """Unique names of the features; features without a name or with equal names are numbered."""
    texts = [prefix + _name(feature.name) if feature.name else "" for feature in features]
    counts = Counter(texts)
    taken = {text for text in texts if counts[text] == 1 and text}
    numbers: Counter[str] = Counter()
    for at, text in enumerate(texts):
        if counts[text] == 1 and text:
            continue
        while texts[at] == text or texts[at] in taken:
            numbers[text] += 1
            texts[at] = f"{text or stem}_{numbers[text]}"
        taken.add(texts[at])
    return texts


def _words(node: ast.FromFile) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the options of a declaration whose values are words."""
    for option in node.options:
        if isinstance(option.value, tuple):
            yield option.word, option.value


def _name(text: str) -> str:
    """The text with ``_`` for each character that names cannot contain."""
    return _NOT_IN_NAMES.sub("_", text)


def _place(node: ast.FromFile, feature: Feature, name: ast.Name) -> Iterator[ast.Declaration]:
    from missionc.frontend.maps.feature import MapPoint

    if isinstance(feature.shape, MapPoint):
        yield ast.Beacon(node.span, name, ast.Point(feature.span, _numbers(feature.shape.position, feature.span)))
        return
    height = node.heights[0] if node.heights else None
    if feature.height is not None:
        low, high = _numbers(feature.height, feature.span)
        height = ast.Height(feature.span, low, high)
    if node.kind == "regions":
        yield ast.Region(node.span, name, _shape(feature, feature.shape, height, whole=True))
    else:
        yield ast.Obstacle(node.span, name, _shape(feature, feature.shape, height, whole=False))


def _shape(feature: Feature, shape: Area | Circle, height: ast.Height | None, *, whole: bool) -> ast.Shape:
    """Shape of a feature as a syntax tree node.

    Args:
        whole: True if an area with holes becomes a difference; False for a union of polygons without holes.
    """
    from missionc.frontend.maps.feature import Circle
    from missionc.frontend.maps.occupancy_grid import without_holes

    span = feature.span
    if isinstance(shape, Circle):
        return ast.Disc(span, ast.Point(span, _numbers(shape.centre, span)), ast.Number(span, shape.radius), height)
    if whole:
        return _joined(span, [_less_holes(span, rings, height) for rings in shape.polygons])
    pieces = [piece for rings in shape.polygons for piece in ([rings[0]] if len(rings) == 1 else without_holes(rings))]
    return _joined(span, [_polygon(span, piece, height) for piece in pieces])


def _less_holes(span: Span, rings: tuple[Corners, ...], height: ast.Height | None) -> ast.Shape:
    outer, *holes = (_polygon(span, ring, height) for ring in rings)
    return ast.Combined(span, "-", outer, _joined(span, holes)) if holes else outer


def _polygon(span: Span, corners: Corners, height: ast.Height | None) -> ast.Shape:
    return ast.Polygon(span, tuple(ast.Point(span, _numbers(corner, span)) for corner in corners), height)


def _joined(span: Span, shapes: list[ast.Shape]) -> ast.Shape:
    return reduce(lambda left, right: ast.Combined(span, "+", left, right), shapes)


# ------------------------------------------------------------------ messages


def _not_for(context: Context, message: str, span: Span, way_out: str) -> None:
    context.report(code.MAP_OPTION, message, span, help=way_out)


def _not_a_name(context: Context, feature: Feature) -> None:
    context.report(
        code.MAP_FEATURE,
        f"`{feature.name[:80]}` cannot be the name of a region, obstacle or beacon",
        feature.name_span,
        help="add a prefix, for example `named hall`",
    )
