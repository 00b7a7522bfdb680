"""Worlds from files: occupancy grids, GeoJSON, tables and drawings become places, or a finding says why not."""

from __future__ import annotations

import json
import math
import os
import shutil
import struct
import subprocess
import sys
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("PIL")
pytest.importorskip("yaml")

from missionc import ir
from missionc.base.diagnostics.code import (
    DECLARED_AGAIN,
    EXTRA_MISSING,
    FILE_TOO_LARGE,
    INCLUDE_NOT_ALLOWED,
    MAP_FEATURE,
    MAP_OPTION,
    MAP_UNREADABLE,
    NAME_TWICE,
    UNKNOWN_SETTING,
    VALUE_OUT_OF_RANGE,
    WRONG_DIMENSION,
    Code,
)
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.cli.app import main
from missionc.compiler.driver import check
from missionc.frontend.maps import map_metadata
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.tools.language_server.open_text import diagnostics
from missionc.tools.language_server.text_edits import RefusedError, definition, rename
from tests.support.mapped_missions import HEAD, YAML, findings, meant, only, picture, written
from tests.support.open_texts import opened

HALL = picture("....", ".##.", "....", "?...")
GRID: Mapping[str, str | bytes] = {"hall.pgm": HALL, "hall.yaml": YAML}
FROM_GRID = 'obstacles from "hall.pgm"'


def corners(shape: ir.Shape) -> set[tuple[float, float]]:
    assert isinstance(shape, ir.Polygon)
    return {(round(x, 6), round(y, 6)) for x, y in shape.corners}


def box(low_x: float, low_y: float, high_x: float, high_y: float) -> set[tuple[float, float]]:
    return {(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)}


def obstacles(mission: ir.Mission) -> dict[str, ir.Shape]:
    return {each.name: each.shape for each in mission.obstacles}


# ------------------------------------------------------------- occupancy grids


def test_cells_lie_where_map_server_puts_them_and_unknown_ones_are_taken(tmp_path: Path) -> None:
    found = obstacles(meant(tmp_path, FROM_GRID, GRID))
    assert {name: corners(shape) for name, shape in found.items()} == {
        "hall_1": box(4, 5, 4.5, 5.5),
        "hall_2": box(4.5, 6, 5.5, 6.5),
    }


def test_unknown_cells_may_be_said_to_be_free(tmp_path: Path) -> None:
    found = obstacles(meant(tmp_path, f"{FROM_GRID} unknown free", GRID))
    assert [corners(shape) for shape in found.values()] == [box(4.5, 6, 5.5, 6.5)]


def test_the_yaml_may_be_named_in_place_of_the_image(tmp_path: Path) -> None:
    by_image = obstacles(meant(tmp_path, FROM_GRID, GRID))
    by_yaml = obstacles(meant(tmp_path, 'obstacles from "hall.yaml"', GRID))
    assert list(by_image.values()) == list(by_yaml.values())


def test_the_mission_has_the_last_word_on_the_size_of_a_cell(tmp_path: Path) -> None:
    found = obstacles(meant(tmp_path, f"param CELL = 1 m\n{FROM_GRID} resolution CELL at (1, 0)", GRID))
    assert corners(found["hall_2"]) == box(6, 7, 8, 8)


def test_an_image_alone_lies_at_the_origin(tmp_path: Path) -> None:
    found = obstacles(meant(tmp_path, f"{FROM_GRID} resolution 50 cm named wall", {"hall.pgm": HALL}))
    assert {name: corners(shape) for name, shape in found.items()} == {
        "wall_1": box(0, 0, 0.5, 0.5),
        "wall_2": box(0.5, 1, 1.5, 1.5),
    }


def test_a_map_may_be_turned(tmp_path: Path) -> None:
    turned = YAML.replace("[4.0, 5.0, 0.0]", f"[14, 5, {math.pi / 2}]")
    found = obstacles(meant(tmp_path, f"{FROM_GRID} unknown free", {"hall.pgm": HALL, "hall.yaml": turned}))
    assert corners(found["hall_1"]) == box(12.5, 5.5, 13, 6.5)


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        (YAML.replace("negate: 0", "negate: 1"), box(4.5, 6, 5.5, 6.5)),
        (YAML.replace("0.65", "0.1"), None),
    ],
)
def test_thresholds_and_negation_are_those_of_the_file(
    tmp_path: Path, metadata: str, expected: set[tuple[float, float]] | None
) -> None:
    image = picture("####", "#..#", "####", "####") if expected else picture("....", ".##.", "....", "?...")
    metadata = metadata.replace("free_thresh: 0.196", "free_thresh: 0.05") if expected is None else metadata
    found = obstacles(meant(tmp_path, f"{FROM_GRID} unknown free", {"hall.pgm": image, "hall.yaml": metadata}))
    # At 0.1 what is light grey is occupied as well, and so is no part of what is unknown.
    assert len(found) == (1 if expected else 2)
    assert expected is None or expected == corners(found["hall_1"])


def test_a_png_is_read_like_a_pgm(tmp_path: Path) -> None:
    image = picture("....", ".##.", "....", "?...", form="PNG")
    by_png = obstacles(
        meant(tmp_path, 'obstacles from "hall.png"', {"hall.png": image, "hall.yaml": YAML.replace(".pgm", ".png")})
    )
    assert list(by_png.values()) == list(obstacles(meant(tmp_path, FROM_GRID, GRID)).values())


def test_in_a_volume_they_stand_as_high_as_is_said(tmp_path: Path) -> None:
    flat = written(tmp_path, f"{FROM_GRID} height 0..3 m", GRID).read_text()
    solid = flat.replace("(0, 0) to (20, 20)", "(0, 0, 0) to (20, 20, 5)")
    (tmp_path / "site.mission").write_text(solid)
    mission = check(tmp_path / "site.mission").mission
    assert mission is not None
    assert {shape.band for shape in obstacles(mission).values()} == {ir.Prism(0, 3)}  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("said", "files", "code", "words"),
    [
        (FROM_GRID, {"hall.pgm": HALL}, MAP_OPTION, "is unknown: there is no `.yaml`"),
        (FROM_GRID, {}, MAP_UNREADABLE, "no such file"),
        (FROM_GRID, {**GRID, "hall.pgm": b"P5\n9 9\n255\nab"}, MAP_UNREADABLE, "is truncated or damaged"),
        (FROM_GRID, {**GRID, "hall.pgm": b"not a picture"}, MAP_UNREADABLE, "not a PGM, PNG or BMP image"),
        (FROM_GRID, {**GRID, "hall.pgm": b""}, MAP_UNREADABLE, "not a PGM, PNG or BMP image"),
        (FROM_GRID, {**GRID, "hall.pgm": b"P5\n60000 60000\n255\n"}, FILE_TOO_LARGE, "3600000000 cells"),
        (FROM_GRID, {**GRID, "hall.pgm": picture("...")}, MAP_FEATURE, "no occupied cell"),
        (
            FROM_GRID,
            {**GRID, "hall.yaml": "image: other.pgm\nresolution: 1\norigin: [0, 0, 0]"},
            MAP_UNREADABLE,
            "other",
        ),
        (FROM_GRID, {**GRID, "hall.yaml": "a: [1"}, MAP_UNREADABLE, "not valid YAML"),
        (FROM_GRID, {**GRID, "hall.yaml": "just words"}, MAP_UNREADABLE, "not a mapping of keys"),
        (FROM_GRID, {**GRID, "hall.yaml": b"\xff\xfe"}, MAP_UNREADABLE, "it is empty"),
        (FROM_GRID, {**GRID, "hall.yaml": "[" * 5000}, MAP_UNREADABLE, ""),
        (FROM_GRID, {**GRID, "hall.yaml": YAML.replace("0.5", "nan")}, MAP_UNREADABLE, "`nan` is not a number"),
        (FROM_GRID, {**GRID, "hall.yaml": YAML.replace("0.5", "-1")}, MAP_UNREADABLE, "must be above 0"),
        (FROM_GRID, {**GRID, "hall.yaml": YAML.replace("0.65", "7")}, MAP_UNREADABLE, "from 0 to 1"),
        (FROM_GRID, {**GRID, "hall.yaml": YAML + "mode: fancy\n"}, MAP_UNREADABLE, "one of `trinary`"),
        (FROM_GRID, {**GRID, "hall.yaml": YAML.replace("negate: 0", "negate: 2")}, MAP_UNREADABLE, "0 or 1"),
        (FROM_GRID, {**GRID, "hall.yaml": YAML.replace("origin: [4.0, 5.0, 0.0]\n", "")}, MAP_UNREADABLE, "origin"),
        (
            FROM_GRID,
            {**GRID, "hall.yaml": YAML.replace("hall.pgm", "!!python/name:os.system")},
            MAP_UNREADABLE,
            "image",
        ),
        ('obstacles from "hall.yaml"', {"hall.yaml": YAML}, MAP_UNREADABLE, "no such file"),
        ('obstacles from "hall.yaml"', {"hall.yaml": YAML.replace("hall.pgm", "/etc/a.pgm")}, INCLUDE_NOT_ALLOWED, ""),
        ('obstacles from "hall.yaml"', {"hall.yaml": YAML.replace("hall.pgm", "../a.pgm")}, INCLUDE_NOT_ALLOWED, ""),
        ('regions from "hall.pgm"', GRID, MAP_OPTION, "only obstacles"),
        (f'{FROM_GRID} layer "A"', GRID, MAP_OPTION, "takes no `layer`"),
        (f"{FROM_GRID} unit 1 m", GRID, UNKNOWN_SETTING, "unit"),
        (f"{FROM_GRID} resolution 0 m", GRID, VALUE_OUT_OF_RANGE, "must be above 0"),
        (f"{FROM_GRID} unknown blue", GRID, UNKNOWN_SETTING, "blue"),
        (f"{FROM_GRID} at (1, 2) at (1, 2)", GRID, DECLARED_AGAIN, "`at`"),
        (f"{FROM_GRID} at (1, 2, 3)", GRID, WRONG_DIMENSION, "two"),
        ('obstacles from "hall.xyz"', {"hall.xyz": "a"}, MAP_UNREADABLE, "extension"),
        ('obstacles from "/etc/hall.pgm"', {}, INCLUDE_NOT_ALLOWED, "not relative"),
        ('obstacles from "../hall.pgm"', {}, INCLUDE_NOT_ALLOWED, "outside"),
    ],
)
def test_what_nothing_can_be_made_of_is_said(
    tmp_path: Path, said: str, files: Mapping[str, str | bytes], code: Code, words: str
) -> None:
    finding = only(tmp_path, said, files)
    assert finding.code is code
    assert words in finding.message
    assert finding.help


def test_many_aliases_cost_nothing(tmp_path: Path) -> None:
    laughs = "\n".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 30))
    found = meant(tmp_path, FROM_GRID, {**GRID, "hall.yaml": f"a0: &a0 [lol]\n{laughs}\n{YAML}"})
    assert len(found.obstacles) == 2


def test_a_picture_that_unpacks_to_much_is_refused_by_its_head(tmp_path: Path) -> None:
    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", 30_000, 30_000, 8, 0, 0, 0, 0)
    bomb = (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(bytes(1 << 16)))
        + chunk(b"IEND", b"")
    )
    finding = only(tmp_path, 'obstacles from "b.png" resolution 1 m', {"b.png": bomb})
    assert finding.code is FILE_TOO_LARGE
    assert "map_cells=900000000" in finding.help


def test_files_are_no_larger_than_the_limit_together(tmp_path: Path) -> None:
    limits = Limits(map_bytes=len(YAML) + 10)
    finding = only(tmp_path, FROM_GRID, GRID, limits)
    assert finding.code is FILE_TOO_LARGE
    assert f"map_bytes={len(HALL) + len(YAML)}" in finding.help
    assert only(tmp_path, FROM_GRID, GRID, Limits(map_bytes=10)).code is FILE_TOO_LARGE


def test_a_link_that_leaves_the_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "hall.pgm").write_bytes(HALL)
    os.symlink(tmp_path / "hall.pgm", tmp_path / "in" / "hall.pgm")
    assert only(tmp_path / "in", FROM_GRID, {"hall.yaml": YAML}).code is INCLUDE_NOT_ALLOWED


def test_a_link_within_the_folder_is_followed(tmp_path: Path) -> None:
    os.symlink("maps/hall.pgm", tmp_path / "hall.pgm")
    checked = check(written(tmp_path, FROM_GRID, {"maps/hall.pgm": HALL, "hall.yaml": YAML}))
    assert checked.ok
    assert len(checked.mission.obstacles) == 2  # type: ignore[union-attr]


def test_a_library_that_is_not_there_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(map_metadata, "import_module", absent)
    finding = only(tmp_path, FROM_GRID, GRID)
    assert finding.code is EXTRA_MISSING
    assert "pip install 'missionc[maps]'" in finding.help


def test_a_mission_without_files_loads_none_of_the_libraries(tmp_path: Path) -> None:
    path = written(tmp_path, "", {})
    code = (
        "import sys; from missionc.compiler.front_end import check; "
        f"assert check({str(path)!r}).ok; "
        "print([each for each in ('PIL', 'yaml', 'ezdxf', 'pyproj', 'missionc.frontend.maps') if each in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --------------------------------------------------------------------- GeoJSON


def square(west: float, south: float, side: float) -> list[list[float]]:
    east, north = west + side, south + side
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


def feature(geometry: str, coordinates: object, /, **properties: object) -> dict[str, object]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": geometry, "coordinates": coordinates}}


def collection(*features: dict[str, object]) -> str:
    return json.dumps({"type": "FeatureCollection", "features": features}, indent=1)


SITE = collection(
    feature("Polygon", [square(10, 10, 4)], name="depot", kind="region"),
    feature("Polygon", [square(5, 10, 4), square(6, 11, 2)], name="Tank 3", kind="obstacle"),
    feature("MultiPolygon", [[square(15, 1, 1)], [square(17, 1, 1)]], name="pair", kind="obstacle", height=2),
    feature("Point", [8, 2], name="mast", kind="beacon", colour="red"),
    feature("Point", [9, 5], name="tree", kind="obstacle", radius=0.5),
)
ALL = 'obstacles from "s.geojson" unit 1 m\nregions from "s.geojson" unit 1 m\nbeacons from "s.geojson" unit 1 m'


def test_features_become_what_they_say_they_are(tmp_path: Path) -> None:
    mission = meant(
        tmp_path, ALL.replace("unit 1 m", "unit 1 m", 1), {"s.geojson": SITE.replace('"height": 2', '"h": 2')}
    )
    assert list(obstacles(mission)) == ["Tank_3", "pair", "tree"]
    assert [each.name for each in mission.regions] == ["base", "goal", "depot"]
    assert [(each.name, each.position) for each in mission.beacons] == [("mast", (8, 2))]
    assert obstacles(mission)["tree"] == ir.Disc((9, 5), 0.5)
    assert corners(mission.regions[-1].shape) == box(10, 10, 14, 14)


def test_an_obstacle_with_a_hole_has_its_true_distances_outside_and_a_region_inside(tmp_path: Path) -> None:
    ring = collection(feature("Polygon", [square(5, 10, 4), square(6, 11, 2)], name="ring"))
    said = 'obstacles from "s.geojson" unit 1 m named o\nregions from "s.geojson" unit 1 m named r'
    mission = meant(tmp_path, said, {"s.geojson": ring})
    assert isinstance(obstacles(mission)["o_ring"], ir.Union)
    assert isinstance(mission.regions[-1].shape, ir.Difference)


def test_longitude_and_latitude_are_metres_from_the_stated_origin(tmp_path: Path) -> None:
    pytest.importorskip("pyproj")
    # One thousandth of a degree north of Zürich is 111.18 m on the ellipsoid, and east 75.5 m.
    places = collection(
        feature("Point", [8.54, 47.3701], name="north", kind="beacon"),
        feature("Point", [8.5401, 47.37], name="east", kind="beacon"),
    )
    mission = meant(tmp_path, 'beacons from "s.geojson" origin (8.54 deg, 47.37 deg) at (1, 2)', {"s.geojson": places})
    north, east = (each.position for each in mission.beacons)
    assert north == pytest.approx((1, 2 + 11.118), abs=2e-3)
    assert east == pytest.approx((1 + 7.554, 2), abs=2e-3)


@pytest.mark.parametrize(
    ("said", "text", "code", "words"),
    [
        ("", SITE, MAP_OPTION, "have neither an origin nor a unit"),
        ("origin (8 deg, 47 deg) unit 1 m", SITE, MAP_OPTION, "both `origin` and `unit`"),
        ("origin (47 deg, 98 deg)", SITE, MAP_OPTION, "not a longitude and a latitude"),
        ("origin (8.5, 47.3)", SITE, MAP_OPTION, "not a longitude and a latitude"),
        ("origin (8 deg, 47 deg, 1 deg)", SITE, MAP_OPTION, "a longitude and a latitude"),
        ("unit 1 m", "{", MAP_UNREADABLE, "not JSON"),
        ("unit 1 m", "[" * 100_000, MAP_UNREADABLE, "nested too deep"),
        ("unit 1 m", '{"type": "Topology"}', MAP_UNREADABLE, "not a `FeatureCollection`"),
        ("unit 1 m", '{"a": 1, "a": 2}', MAP_UNREADABLE, "is duplicated"),
        ("unit 1 m", collection(), MAP_FEATURE, "has no obstacle"),
        ("unit 1 m", '{"type": "FeatureCollection", "features": [3]}', MAP_FEATURE, "not a `Feature`"),
        ("unit 1 m", collection(feature("Polygon", [square(1, 1, 0)])), MAP_FEATURE, "three different corners"),
        (
            "unit 1 m",
            collection(feature("Polygon", [[[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]])),
            MAP_FEATURE,
            "crosses",
        ),
        ("unit 1 m", collection(feature("Polygon", [[[0, 0], [4, 4], [4, 0]]])), MAP_FEATURE, "four positions"),
        ("unit 1 m", collection(feature("Polygon", [[]])), MAP_FEATURE, "four positions"),
        ("unit 1 m", collection(feature("Polygon", [])), MAP_FEATURE, "left out: 1 Feature (its geometry is empty)"),
        ("unit 1 m", collection(feature("Polygon", [square(1, 1, math.nan)])), MAP_FEATURE, "not a number"),
        ("unit 1 m", collection(feature("Polygon", [square(1, 1, 1e300)])), MAP_FEATURE, "too large"),
        ("unit 1 m", collection(feature("LineString", [[0, 0], [1, 1]])), MAP_FEATURE, "neither a polygon nor a point"),
        ("unit 1 m", collection(feature("Point", [1, 1], kind="obstacle")), MAP_FEATURE, "needs a `radius`"),
        ("unit 1 m", collection(feature("Point", [1, 1], kind="obstacle", radius=-1)), MAP_FEATURE, "must be above 0"),
        (
            "unit 1 m",
            collection(feature("Point", [1, 1], kind="wall")),
            MAP_FEATURE,
            "left out: 1 Point (its `kind` is",
        ),
        ("unit 1 m", collection(feature("Polygon", [square(1, 1, 1)], name=3)), MAP_FEATURE, "expected a text as name"),
        ("unit 1 m", collection(feature("Polygon", [square(9, 1, 1)], name="3rd")), MAP_FEATURE, "cannot be the name"),
        (
            "unit 1 m",
            collection(feature("Polygon", [square(9, 1, 1)], name="until")),
            MAP_FEATURE,
            "cannot be the name",
        ),
        ("unit 1 m", collection(feature("Polygon", [square(9, 1, 1)], name="base")), NAME_TWICE, "declared twice"),
        ("origin (8 deg, 47 deg)", collection(feature("Polygon", [square(400, 1, 1)])), MAP_FEATURE, "unit 1 m"),
    ],
)
def test_geojson_that_nothing_can_be_made_of_is_said(
    tmp_path: Path, said: str, text: str, code: Code, words: str
) -> None:
    finding = only(tmp_path, f'obstacles from "s.geojson" {said}', {"s.geojson": text})
    assert finding.code is code
    assert words in finding.message + finding.help


def test_a_finding_points_at_the_line_of_the_file(tmp_path: Path) -> None:
    text = SITE.replace('"radius": 0.5', '"radius": 0')
    finding = only(tmp_path, 'obstacles from "s.geojson" unit 1 m height 0..1 m', {"s.geojson": text})
    assert finding.primary is not None
    span = finding.primary.span
    assert span.source.name.endswith("s.geojson")
    assert '"tree"' in text[span.start :].split('"Feature"')[1]


# ---------------------------------------------------------------------- tables


def test_rows_become_discs_rectangles_and_points(tmp_path: Path) -> None:
    table = "name, kind, x, y, radius, width, depth, angle\npost,obstacle,9,9,0.5,,,\nrack,obstacle,12,9,,4,2,90\n"
    table += "dock,region,15,15,1,,,\nmast,beacon,1,9,,,,\n"
    said = "\n".join(f'{kind} from "p.csv"' for kind in ("obstacles", "regions", "beacons"))
    mission = meant(tmp_path, said, {"p.csv": table})
    assert obstacles(mission)["post"] == ir.Disc((9, 9), 0.5)
    assert corners(obstacles(mission)["rack"]) == box(11, 7, 13, 11)
    assert mission.regions[-1].shape == ir.Disc((15, 15), 1)
    assert mission.beacons[0].position == (1, 9)


def test_a_unit_is_of_every_length(tmp_path: Path) -> None:
    mission = meant(tmp_path, 'obstacles from "p.csv" unit 1 mm at (1, 0)', {"p.csv": "x,y,radius\n9000,8000,500\n"})
    assert obstacles(mission) == {"p_1": ir.Disc((10, 8), 0.5)}


@pytest.mark.parametrize(
    ("table", "code", "words"),
    [
        ("", MAP_UNREADABLE, "no UTF-8 text"),
        (b"\xff\xfe\x00", MAP_UNREADABLE, "no UTF-8 text"),
        (",,,\n,,,\n", MAP_UNREADABLE, "it is empty"),
        ("x,y,radius\n1_0,1,1\n", MAP_FEATURE, "`1_0` in column `x` is not a number"),
        ("x,y,raduis\n1,1,1\n", MAP_FEATURE, "did you mean `radius`?"),
        ("x;y;radius\n1;1;1\n", MAP_FEATURE, "separated by `;`"),
        ("x\ty\tradius\n1\t1\t1\n", MAP_FEATURE, "separated by tabs"),
        ("x,x,y\n1,1,1\n", MAP_FEATURE, "duplicate column"),
        ("y,radius\n1,1\n", MAP_FEATURE, "missing column `x`"),
        ("x,y,radius\n", MAP_FEATURE, "no row"),
        ("x,y,radius\n1,1\n", MAP_FEATURE, "2 values"),
        ("x,y,radius\n1,one,1\n", MAP_FEATURE, "`one` in column `y`"),
        ("x,y,radius\n1,inf,1\n", MAP_FEATURE, "`inf` in column `y`"),
        ("x,y,radius\n1,,1\n", MAP_FEATURE, "is empty here"),
        ("x,y,radius\n1,1,0\n", MAP_FEATURE, "must be above 0"),
        ("x,y,radius,width\n1,1,1,1\n", MAP_FEATURE, "or a `width` and a `depth`"),
        ("x,y,z,radius\n1,1,1,1\n", MAP_FEATURE, "only a beacon"),
        ("x,y,radius,kind\n1,1,1,lake\n", MAP_FEATURE, "unknown kind"),
        ('x,y,radius\n1,1,"1\n', MAP_UNREADABLE, "not valid CSV"),
    ],
)
def test_tables_that_nothing_can_be_made_of_are_said(
    tmp_path: Path, table: str | bytes, code: Code, words: str
) -> None:
    finding = only(tmp_path, 'obstacles from "p.csv"', {"p.csv": table})
    assert finding.code is code
    assert words in finding.message + finding.help


def test_rows_are_limited(tmp_path: Path) -> None:
    table = "x,y,radius\n" + "9,9,1\n" * 20
    finding = only(tmp_path, 'obstacles from "p.csv"', {"p.csv": table}, Limits(map_features=19))
    assert finding.code is FILE_TOO_LARGE
    assert "map_features=20" in finding.help


def test_starts_finishes_routes_and_offsets_may_be_listed(tmp_path: Path) -> None:
    said = """team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)
  start from "starts.csv"  finish from "ends.csv" }
obstacle cart = disc at (10, 10) radius 1 m along from "route.csv" uncertain 0.01 m/s
formation vee = offsets of drone from "vee.csv" tolerance 0.2 m
require eventually[0, 30 s] vee
"""
    files = {
        "starts.csv": "x,y\n1,8\n2,8\n3,8\n",
        "ends.csv": "name,x,y\na,1,12\nb,2,12\nc,3,12\n",
        "route.csv": "t,x,y\n0,0,0\n4,3,0\n",
        "vee.csv": "x,y\n0,0\n-1,1\n-1,-1\n",
    }
    mission = meant(tmp_path, said, files)
    drones = mission.agents[1:]
    assert [each.start.point for each in drones] == [(1, 8), (2, 8), (3, 8)]  # type: ignore[union-attr]
    assert [each.finish.point for each in drones] == [(1, 12), (2, 12), (3, 12)]  # type: ignore[union-attr]
    assert mission.obstacles[0].motion == ir.Path((0, 4), ((0, 0), (3, 0)))
    assert [edge.target for edge in mission.formations[0].edges] == [(-1, 1), (-1, -1)]


@pytest.mark.parametrize(
    ("name", "table", "code"),
    [
        ("starts.csv", "x,y\n1,8\n", VALUE_OUT_OF_RANGE),
        ("starts.csv", "x,y,z\n1,8,1\n2,8,1\n", WRONG_DIMENSION),
        ("starts.csv", "t,x,y\n0,1,8\n1,2,8\n", MAP_FEATURE),
        ("starts.txt", "x,y\n1,8\n2,8\n", MAP_UNREADABLE),
    ],
)
def test_a_list_of_starts_that_does_not_fit_is_said(tmp_path: Path, name: str, table: str, code: Code) -> None:
    said = f'team drone[2] {{ dynamics single_integrator(speed <= 2 m/s)  start from "{name}" }}'
    assert {finding.code for finding in findings(tmp_path, said, {name: table})} == {code}


# -------------------------------------------------------------------- drawings


def drawn(folder: Path, units: int = 4) -> bytes:
    """A drawing in millimetres with racks as blocks, a tank, and a label."""
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new(units=units)
    document.header["$INSUNITS"] = units
    for layer in ("RACKS", "TANKS", "LINES"):
        document.layers.add(layer)
    block = document.blocks.new("RACK")
    block.add_lwpolyline([(0, 0), (4000, 0), (4000, 1000), (0, 1000)], close=True, dxfattribs={"layer": "RACKS"})
    space = document.modelspace()
    for y in (9000, 12000):
        space.add_blockref("RACK", (9000, y), dxfattribs={"layer": "RACKS"})
    space.add_circle((6000, 15000), 500, dxfattribs={"layer": "TANKS"})
    space.add_lwpolyline([(15e3, 15e3, 1), (17e3, 15e3, 1)], "xyb", close=True, dxfattribs={"layer": "TANKS"})
    space.add_line((0, 0), (1, 1), dxfattribs={"layer": "LINES"})
    space.add_point((1000, 9000), dxfattribs={"layer": "TANKS"})
    space.add_text("hall", dxfattribs={"layer": "RACKS"})
    document.saveas(folder / "floor.dxf")
    return (folder / "floor.dxf").read_bytes()


def test_closed_outlines_circles_and_points_of_a_drawing_are_read(tmp_path: Path) -> None:
    drawing = drawn(tmp_path)
    said = 'obstacles from "floor.dxf" layer "RACKS", "TANKS"\nbeacons from "floor.dxf" named mast'
    mission = meant(tmp_path, said, {"floor.dxf": drawing})
    racks = list(obstacles(mission).values())
    assert [corners(shape) for shape in racks[:2]] == [box(9, 9, 13, 10), box(9, 12, 13, 13)]
    assert racks[2] == ir.Disc((6, 15), 0.5)
    assert isinstance(racks[3], ir.Polygon)
    assert min(math.dist(corner, (16, 15)) for corner in racks[3].corners) >= 1
    assert max(math.dist(corner, (16, 15)) for corner in racks[3].corners) <= 1.05
    assert [(each.name, each.position) for each in mission.beacons] == [("mast_1", (1, 9))]


@pytest.mark.parametrize(
    ("said", "units", "code", "words"),
    [
        ("", 4, MAP_FEATURE, "LINE in layer `LINES` is open"),
        ('layer "WALLS"', 4, MAP_OPTION, "no layer `WALLS`"),
        ('layer "RACKS"', 0, MAP_OPTION, "does not state the length of its unit"),
    ],
)
def test_drawings_that_nothing_can_be_made_of_are_said(
    tmp_path: Path, said: str, units: int, code: Code, words: str
) -> None:
    finding = only(tmp_path, f'obstacles from "floor.dxf" {said}', {"floor.dxf": drawn(tmp_path, units)})
    assert finding.code is code
    assert words in finding.message


@pytest.mark.parametrize("content", [b"", b"\x00\x01", b"0\nSECTION\n", b"AutoCAD Binary DXF\r\n\x1a\x00zz"])
def test_what_is_no_drawing_is_refused(tmp_path: Path, content: bytes) -> None:
    pytest.importorskip("ezdxf")
    assert only(tmp_path, 'obstacles from "floor.dxf"', {"floor.dxf": content}).code is MAP_UNREADABLE


# ---------------------------------------------------------------------- names


def test_the_words_may_still_be_names_and_a_kind_of_graph(tmp_path: Path) -> None:
    said = """region obstacles = box (5, 5) to (6, 6)
region regions = box (7, 5) to (8, 6)
region origin = box (9, 5) to (10, 6)
beacon layer = (1, 1)
agent other { dynamics single_integrator(speed <= 2 m/s)  start at (1, 8) }
graph radio = beacons 3 m
require off: scout: always[0, 30 s] not (obstacles or regions or origin)
require near: scout: always[0, 30 s] distance(layer) <= 90 m
require linked: eventually[0, 30 s] connected(radio)
"""
    assert len(meant(tmp_path, said, {}).regions) == 5


def test_places_that_nothing_uses_earn_no_warning_and_have_no_fix_in_the_file(tmp_path: Path) -> None:
    assert findings(tmp_path, 'regions from "s.geojson" unit 1 m', {"s.geojson": SITE}) == []


def test_a_file_that_two_declarations_name_is_read_once(tmp_path: Path) -> None:
    path = written(tmp_path, ALL, {"s.geojson": SITE.replace('"height": 2', '"h": 2')})
    names = [Path(each.name).name for each in check(path).sources]
    assert names == ["site.mission", "s.geojson"]


def test_spans_of_a_picture_are_the_words_that_name_it(tmp_path: Path) -> None:
    mission = meant(tmp_path, FROM_GRID, GRID)
    assert {each.span.text for each in mission.obstacles} == {'"hall.pgm"'}
    assert isinstance(mission.obstacles[0].span, Span)
    assert isinstance(mission.obstacles[0].span.source, Source)
    assert HEAD in mission.obstacles[0].span.source.text


# ------------------------------------------------------------------- folders


PLANNED = """mission site
time  step 1 s, horizon 20 s
world (0, 0) to (10, 10)
obstacles from "maps/hall.pgm"
regions from "places.csv"
agent scout { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start from "starts.csv" }
require there: scout: eventually[0, 20 s] goal
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan through a map, and nothing left of what it was read from."""
    beside = tmp_path_factory.mktemp("mission")
    files = {"maps/hall.pgm": HALL, "maps/hall.yaml": YAML, "places.csv": "name,x,y,radius\ngoal,8,8,1\n"}
    path = written(beside, "", {**files, "starts.csv": "x,y\n1,1\n"})
    path.write_text(PLANNED, encoding="utf-8")
    out = tmp_path_factory.mktemp("plan") / "out"
    assert main(["compile", str(path), "--backend", "smt", "-o", str(out)]) == 0
    shutil.rmtree(beside)
    return out


def test_a_folder_holds_the_files_and_is_verified_from_them(folder: Path) -> None:
    held = {path.relative_to(folder / "mission").as_posix() for path in (folder / "mission").rglob("*.*")}
    assert held == {"site.mission", "maps/hall.pgm", "maps/hall.yaml", "places.csv", "starts.csv"}
    assert (folder / "mission" / "maps" / "hall.pgm").read_bytes() == HALL
    assert set(json.loads((folder / "manifest.json").read_text())["inputs"]) == held
    assert main(["verify", str(folder)]) == 0


def test_a_folder_with_another_map_is_refused(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    (out / "mission" / "maps" / "hall.pgm").write_bytes(picture("....", "###.", "....", "?..."))
    assert main(["verify", str(out)]) != 0


# ------------------------------------------------------------------- spoilt files


def test_spoilt_files_are_read_or_refused_and_nothing_else(tmp_path: Path) -> None:
    generator = np.random.default_rng(5)
    whole = {
        "hall.pgm": HALL,
        "hall.yaml": YAML.encode(),
        "site.geojson": SITE.encode(),
        "rows.csv": b"name,x,y,radius\na,9,9,1\nb,12,9,1\n",
        "floor.dxf": drawn(tmp_path),
    }
    said = f"""{FROM_GRID}
obstacles from "site.geojson" unit 1 m named s
obstacles from "rows.csv" named r
obstacles from "floor.dxf" layer "RACKS" named f
"""
    codes = set()
    for number in range(int(os.environ.get("MISSIONC_FUZZ", "60"))):
        name = list(whole)[number % len(whole)]
        spoilt = bytearray(whole[name])
        for _ in range(int(generator.integers(1, 6))):
            spoilt[int(generator.integers(0, len(spoilt)))] = int(generator.integers(0, 256))
        found = findings(tmp_path, said, {**whole, name: bytes(spoilt[: int(generator.integers(1, len(spoilt) + 1))])})
        assert all(finding.message and finding.primary for finding in found)
        codes |= {finding.code for finding in found}
    assert {MAP_UNREADABLE, MAP_FEATURE} <= codes


# --------------------------------------------------------------------- editors


def test_an_editor_goes_to_the_place_in_the_file_and_renames_nothing_there(tmp_path: Path) -> None:
    path = written(tmp_path, 'regions from "s.geojson" unit 1 m\nrequire far: scout: always[0, 30 s] not depot\n',
                   {"s.geojson": SITE})  # fmt: skip
    text = opened(path.read_text(), name=str(path))
    place = text.places.position(text.source.text.index("depot"))
    found = definition(text, place)
    assert found is not None
    assert found.uri.endswith("s.geojson")
    assert SITE.splitlines()[found.range.start.line].strip() == '"name": "depot",'
    with pytest.raises(RefusedError, match=r"declared in .*s\.geojson"):
        rename(text, place, "yard")


def test_an_editor_knows_the_obstacles_of_a_picture_by_the_words_that_name_it(tmp_path: Path) -> None:
    path = written(tmp_path, f"{FROM_GRID}\nregion copy = hall_1\nrequire a: scout: always[0, 30 s] not copy\n", GRID)
    text = opened(path.read_text(), name=str(path))
    place = text.places.position(text.source.text.index("hall_1"))
    found = definition(text, place)
    assert found is not None
    assert text.source.text.splitlines()[found.range.start.line] == FROM_GRID
    with pytest.raises(RefusedError, match="`named`"):
        rename(text, place, "wall")


def test_an_editor_shows_what_is_wrong_in_a_file_where_the_mission_names_it(tmp_path: Path) -> None:
    path = written(tmp_path, 'obstacles from "p.csv"', {"p.csv": "x,y,radius\n1,1,0\n"})
    text = opened(path.read_text(), name=str(path))
    assert text.found is not None
    (shown,) = diagnostics(text, text.found.findings)
    lines = text.source.text.splitlines()
    assert lines[shown.range.start.line][shown.range.start.character : shown.range.end.character] == '"p.csv"'
    assert shown.related_information is not None
    assert shown.related_information[0].location.range.start.line == 1


# -------------------------------------------------------------------- the layout


def test_the_layout_sets_declarations_of_files_as_a_table(tmp_path: Path) -> None:
    source = Source("a.mission", 'mission a\nobstacles   from "h.yaml"  within 1m\nregions from "s.csv"\n')
    program, found = parse(source, Limits(), unread)
    assert (program is not None, found) == (True, [])
    assert program is not None
    laid_out = format_mission(source, program, Limits())
    assert laid_out == 'mission a\nobstacles from "h.yaml" within 1 m\nregions   from "s.csv"\n'
