"""GeoJSON: what becomes a place, what is left out with a count, and what is an error."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from missionc import ir
from missionc.base.diagnostics.code import MAP_FEATURE, MAP_LEFT_OUT, MAP_OPTION
from missionc.compiler.driver import check
from tests.support.mapped_missions import findings, meant, only, written

SAID = 'obstacles from "s.geojson" unit 1 m'
SQUARE = [[[5, 10], [7, 10], [7, 12], [5, 12], [5, 10]]]


def feature(kind: str, coordinates: object, /, **properties: object) -> dict[str, object]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def collection(*features: object) -> dict[str, str | bytes]:
    return {"s.geojson": json.dumps({"type": "FeatureCollection", "features": features}, indent=1)}


HALL = feature("Polygon", SQUARE, name="hall")


def names(mission: ir.Mission) -> list[str]:
    return [each.name for each in mission.obstacles]


@pytest.mark.parametrize(
    ("part", "kind", "reason"),
    [
        (feature("LineString", [[1, 1], [2, 2]]), "LineString", "neither a polygon nor a point"),
        (feature("MultiLineString", [[[1, 1], [2, 2]]]), "MultiLineString", "neither a polygon nor a point"),
        ({"type": "Feature", "properties": {}, "geometry": None}, "Feature", "its geometry is empty"),
        (feature("Polygon", []), "Feature", "its geometry is empty"),
        (feature("Polygon", SQUARE, kind="building"), "Polygon", "its `kind` is not one of"),
        (feature("Point", [1, 9], radius_m=3), "Point", "found `radius_m`"),
    ],
)
def test_what_makes_no_place_is_left_out_and_named_with_its_count(
    tmp_path: Path, part: dict[str, object], kind: str, reason: str
) -> None:
    checked = check(written(tmp_path, SAID, collection(part, HALL, part)))
    (finding,) = checked.findings
    assert finding.code is MAP_LEFT_OUT
    assert f"left out 2 `{kind}`: " in finding.message
    assert reason in finding.message
    assert finding.help
    assert finding.primary is not None
    assert finding.primary.span.source.place(finding.primary.span.start)[0] == 4
    assert checked.mission is not None
    assert names(checked.mission) == ["hall"]
    (file,) = checked.mission.files
    assert (file.summary.count, [each.count for each in file.summary.left_out]) == (1, [2])


def test_what_another_declaration_may_read_is_counted_without_a_warning(tmp_path: Path) -> None:
    mission = meant(tmp_path, SAID, collection(HALL, feature("Point", [1, 9]), feature("Point", [2, 9], kind="beacon")))
    assert [(each.kind, each.count) for each in mission.files[0].summary.left_out] == [("Point", 1)]


def test_a_part_that_no_declaration_of_a_file_can_read_earns_one_warning(tmp_path: Path) -> None:
    said = f"{SAID} named o\nregions{SAID.removeprefix('obstacles')} named r"
    (finding,) = findings(tmp_path, said, collection(HALL, feature("LineString", [[1, 1], [2, 2]])))
    assert finding.code is MAP_LEFT_OUT


def test_a_property_that_is_null_is_as_good_as_absent(tmp_path: Path) -> None:
    nulls = {"kind": None, "radius": None, "height": None, "name": None}
    line = feature("LineString", [[1, 1], [2, 2]], **nulls)
    checked = check(written(tmp_path, SAID, collection(HALL, line, feature("Point", [1, 9], **nulls))))
    assert [finding.code for finding in checked.findings] == [MAP_LEFT_OUT]


def test_a_feature_that_states_its_kind_is_never_left_out(tmp_path: Path) -> None:
    line = feature("LineString", [[1, 1], [2, 2]], kind="obstacle")
    assert only(tmp_path, SAID, collection(HALL, line)).code is MAP_FEATURE


@pytest.mark.parametrize("radius", [2, "2", "2 m", "2.0"])
def test_a_point_with_a_radius_is_a_disc_however_its_radius_is_written(tmp_path: Path, radius: object) -> None:
    mission = meant(tmp_path, SAID, collection(feature("Point", [9, 9], Radius=radius)))
    assert mission.obstacles[0].shape == ir.Disc((9, 9), 2)


def test_a_radius_that_is_no_number_is_an_error_in_the_words_of_the_file(tmp_path: Path) -> None:
    finding = only(tmp_path, SAID, collection(feature("Point", [9, 9], radius={"m": None})))
    assert finding.code is MAP_FEATURE
    assert '`{"m": null}` is not a number' in finding.message


def test_points_of_a_multipoint_are_places_of_their_own(tmp_path: Path) -> None:
    points = feature("MultiPoint", [[9, 9], [12, 9]], name="mast", radius=1)
    assert names(meant(tmp_path, SAID, collection(points))) == ["mast_1", "mast_2"]
    points = feature("MultiPoint", [[9, 9], [12, 9]], name="mast")
    mission = meant(tmp_path, 'beacons from "s.geojson" unit 1 m', collection(points))
    assert [each.position for each in mission.beacons] == [(9, 9), (12, 9)]


def test_members_of_a_geometry_collection_are_read_each_as_what_it_is(tmp_path: Path) -> None:
    other = [[[x + 5, y] for x, y in SQUARE[0]]]
    inside = [HALL["geometry"], {"type": "LineString", "coordinates": [[1, 1], [2, 2]]}]
    nested = {"type": "GeometryCollection", "geometries": [{"type": "Polygon", "coordinates": other}]}
    geometry = {"type": "GeometryCollection", "geometries": [*inside, nested]}
    checked = check(written(tmp_path, SAID, collection({"type": "Feature", "properties": {}, "geometry": geometry})))
    assert [finding.code for finding in checked.findings] == [MAP_LEFT_OUT]
    assert checked.mission is not None
    assert isinstance(checked.mission.obstacles[0].shape, ir.Union)


def test_collections_may_be_nested_as_deep_as_json_goes(tmp_path: Path) -> None:
    deep = '{"type":"GeometryCollection","geometries":['
    text = f'{{"type":"Feature","properties":{{}},"geometry":{deep * 300}{json.dumps(HALL["geometry"])}{"]}" * 300}}}'
    assert len(meant(tmp_path, SAID, {"s.geojson": text}).obstacles) == 1


@pytest.mark.parametrize("root", [HALL, HALL["geometry"]])
def test_a_feature_or_a_geometry_alone_is_a_file(tmp_path: Path, root: object) -> None:
    assert len(meant(tmp_path, SAID, {"s.geojson": json.dumps(root)}).obstacles) == 1


@pytest.mark.parametrize("height", ["12", 12, "about 12", [1, 2], {}])
def test_heights_are_not_read_in_a_plane(tmp_path: Path, height: object) -> None:
    mission = meant(tmp_path, SAID, collection(feature("Polygon", SQUARE, height=height)))
    assert [(each.kind, each.count) for each in mission.files[0].summary.left_out] == [("height", 1)]


def test_a_height_in_a_volume_may_be_a_text(tmp_path: Path) -> None:
    path = written(tmp_path, SAID, collection(feature("Polygon", SQUARE, height="3 m")))
    path.write_text(path.read_text().replace("(0, 0) to (20, 20)", "(0, 0, 0) to (20, 20, 5)"))
    mission = check(path).mission
    assert mission is not None
    assert mission.obstacles[0].shape.band == ir.Prism(0, 3)  # type: ignore[union-attr]


def test_features_of_one_name_are_numbered(tmp_path: Path) -> None:
    taken = feature("Polygon", SQUARE, name="hall 1")
    assert names(meant(tmp_path, SAID, collection(HALL, taken, HALL))) == ["hall_2", "hall_1", "hall_3"]


def test_a_foreign_coordinate_system_is_refused_with_its_name(tmp_path: Path) -> None:
    document = {
        "type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}},
        "features": [HALL],
    }
    said = 'obstacles from "s.geojson" origin (8 deg, 47 deg)'
    finding = only(tmp_path, said, {"s.geojson": json.dumps(document)})
    assert finding.code is MAP_OPTION
    assert "EPSG::25832" in finding.message
    assert findings(tmp_path, SAID, {"s.geojson": json.dumps(document)}) == []
