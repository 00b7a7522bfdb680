"""Places outside the world: a warning for each, an error with its likely cause for all of a file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import FILE_OUTSIDE_WORLD, PLACE_OUTSIDE_WORLD, REGION_OUTSIDE_WORLD
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.maps.likely_cause import likely_cause
from missionc.ir.places import FileRequest
from tests.support.mapped_missions import findings, only, picture

BESIDE = "require r: scout: always[0, 30 s] "


def outside(folder: Path, mission: str, files: dict[str, str | bytes] | None = None) -> list[Diagnostic]:
    codes = (FILE_OUTSIDE_WORLD, PLACE_OUTSIDE_WORLD, REGION_OUTSIDE_WORLD)
    return [finding for finding in findings(folder, mission, files or {}) if finding.code in codes]


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("obstacle far = box (100, 0) to (110, 10)", "obstacle `far` lies outside the world, 80 m away"),
        ("region far = disc at (10, 30) radius 1 m", "region `far` lies outside the world, 9 m away"),
        ("beacon far = (-50, 10)", "beacon `far` lies outside the world, 50 m away"),
        (
            "obstacle far = box (30, 0) to (31, 1) + box (40, 0) to (41, 1)",
            "obstacle `far` lies outside the world, 10 m away",
        ),
        (
            "obstacle far = box (-9, -9) to (30, 30) - box (-9, -9) to (30, 30)",
            "",
        ),
        ("obstacle far = disc at (30, 5) radius 1 m moving (1, 0) m/s", "obstacle `far` lies outside"),
        ("obstacle far = disc at (30, 5) radius 1 m moving (-1, 0) m/s", ""),
        ("obstacle far = disc at (30, 5) radius 1 m uncertain 0.5 m/s", ""),
        ("obstacle wall = box (-1, 0) to (0, 20)", ""),
        ("obstacle wall = box (-1, 0) to (-0.05, 20)", ""),
        ("obstacle wall = box (-1, 0) to (-0.2, 20)", "obstacle `wall` lies outside the world, 0.2 m away"),
    ],
)
def test_a_place_of_the_text_outside_the_world_earns_a_warning(tmp_path: Path, said: str, message: str) -> None:
    found = [finding for finding in outside(tmp_path, said) if finding.code is PLACE_OUTSIDE_WORLD]
    assert [finding.message[: len(message)] for finding in found] == ([message] if message else [])


@pytest.mark.parametrize(
    ("said", "code"),
    [
        (f"region far = disc at (30, 5) radius 1 m\n{BESIDE}distance(far) >= 1", None),
        (f"beacon far = (30, 5)\n{BESIDE}distance(far) >= 1", None),
        (f"beacon far = (90, 5)\n{BESIDE}distance(far) >= 1", PLACE_OUTSIDE_WORLD),
        (f"region far = disc at (90, 5) radius 1 m\n{BESIDE}distance(far) >= 1", PLACE_OUTSIDE_WORLD),
        (f"region far = disc at (90, 5) radius 1 m\n{BESIDE}not far", REGION_OUTSIDE_WORLD),
    ],
)
def test_a_place_that_is_measured_may_lie_beside_the_world(tmp_path: Path, said: str, code: object) -> None:
    assert [finding.code for finding in outside(tmp_path, said)] == ([code] if code else [])


def site(*, swapped: bool) -> dict[str, str | bytes]:
    """A building of 15 m near 47.38 N, 8.54 E."""
    ring = [(8.5400, 47.3800), (8.5402, 47.3800), (8.5402, 47.38013), (8.5400, 47.38013), (8.5400, 47.3800)]
    geometry = {"type": "Polygon", "coordinates": [[[y, x] if swapped else [x, y] for x, y in ring]]}
    return {"s.geojson": json.dumps({"type": "Feature", "properties": {}, "geometry": geometry})}


def grid(origin: str) -> dict[str, str | bytes]:
    return {
        "hall.pgm": picture("##..", "....", "...."),
        "hall.yaml": f"image: hall.pgm\nresolution: 1\norigin: {origin}\n",
    }


@pytest.mark.parametrize(
    ("said", "files", "help_"),
    [
        ('"s.geojson" origin (8.54 deg, 47.38 deg)', site(swapped=True), "swap longitude and latitude"),
        ('"s.geojson" origin (47.38 deg, 8.54 deg)', site(swapped=False), "swap longitude and latitude"),
        ('"s.geojson" origin (9.54 deg, 47.38 deg)', site(swapped=False), "`origin (8.54000 deg, 47.38000 deg)`"),
        ('"s.geojson" unit 1 m at (50, 0)', site(swapped=False), "`origin (8.54 deg, 47.38 deg)` in place of `unit`"),
        ('"r.csv"', {"r.csv": "x,y,radius\n9000,8000,500\n"}, "`unit 1 mm`"),
        ('"r.csv"', {"r.csv": "x,y,radius\n900,800,50\n"}, "`unit 1 cm`"),
        ('"r.csv" unit 1 mm at (-1, -1)', {"r.csv": "x,y,radius\n9,8,0.5\n"}, "`unit 1 m`"),
        ('"r.csv"', {"r.csv": "x,y,radius\n465000,5247000,1\n465010,5247012,1\n"}, "`at (-464999, -5246999)`"),
        ('"hall.yaml"', grid("[30, 0, 0]"), "`at (-30, 0)`"),
    ],
)
def test_a_file_outside_the_world_is_an_error_with_its_likely_cause(
    tmp_path: Path, said: str, files: dict[str, str | bytes], help_: str
) -> None:
    pytest.importorskip("pyproj")
    finding = only(tmp_path, f"obstacles from {said}", files)
    assert finding.code is FILE_OUTSIDE_WORLD
    assert "outside the world" in finding.message
    assert help_ in finding.help


def test_exchanged_axes_of_a_table_are_named() -> None:
    source = Source("r.csv", "")
    asked = FileRequest("obstacle", (source,), Span(source, 0, 0), Limits())
    assert "swap `x` and `y`" in likely_cause(asked, ((5, 80), (6, 81)), ((0, 0), (100, 10)))


def test_the_unit_that_a_drawing_states_is_replaced_by_the_one_that_fits(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new(units=6)
    document.modelspace().add_circle((9000, 8000), 500)
    document.saveas(tmp_path / "floor.dxf")
    finding = only(tmp_path, 'obstacles from "floor.dxf"', {"floor.dxf": (tmp_path / "floor.dxf").read_bytes()})
    assert finding.code is FILE_OUTSIDE_WORLD
    assert "`unit 1 mm`" in finding.help


def test_some_places_of_a_file_outside_the_world_share_one_warning(tmp_path: Path) -> None:
    (finding,) = outside(tmp_path, 'obstacles from "r.csv"', {"r.csv": "x,y,radius\n9,9,1\n90,9,1\n91,9,1\n"})
    assert finding.code is PLACE_OUTSIDE_WORLD
    assert finding.message == "2 of 3 obstacles of `r.csv` lie outside the world"
    assert [label.message for label in finding.labels] == ["the world", "`r_2`"]


def test_walls_around_the_world_are_no_error(tmp_path: Path) -> None:
    walls = {"r.csv": "x,y,width,depth\n-5,10,1,40\n25,10,1,40\n"}
    (finding,) = outside(tmp_path, 'obstacles from "r.csv"', walls)
    assert finding.code is PLACE_OUTSIDE_WORLD
    (finding,) = outside(tmp_path, 'obstacles from "hall.yaml" resolution 25 m', grid("[-20, -20, 0]"))
    assert finding.code is PLACE_OUTSIDE_WORLD


def test_regions_of_a_misplaced_file_are_reported_once(tmp_path: Path) -> None:
    table = {"r.csv": "name,x,y,radius\ndock,9000,8000,500\nyard,9000,6000,500\n"}
    (finding,) = outside(tmp_path, f'regions from "r.csv"\n{BESIDE}not (dock or yard)', table)
    assert finding.code is FILE_OUTSIDE_WORLD
