"""Summaries of files of places: counts, what was left out and why, extents."""

from __future__ import annotations

from missionc.base.source import Source, Span
from missionc.frontend.maps.feature import Area, Circle, Feature, MapPoint
from missionc.frontend.maps.read_map import Reading, count_left_out
from missionc.ir.places import LeftOut, ReadSummary

SPAN = Span(Source("a.dxf", ""), 0, 0)


def feature(shape: Area | Circle | MapPoint) -> Feature:
    return Feature("", shape, SPAN, SPAN)


def test_extents_enclose_areas_discs_and_points() -> None:
    square = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
    features = [feature(Area(((square,),))), feature(Circle((5, 5), 2)), feature(MapPoint((-1, 3, 9)))]
    assert Reading(features).summary() == ReadSummary(3, (), ((-1, 0), (7, 7)))


def test_a_file_without_features_has_no_extents() -> None:
    left_out = count_left_out([("TEXT", "not an area")])
    assert Reading([], left_out).summary() == ReadSummary(0, (LeftOut("TEXT", "not an area", 1),), None)


def test_equal_kinds_left_out_for_one_reason_are_counted_together() -> None:
    parts = [("TEXT", "not an area"), ("CIRCLE", "hidden layer"), ("TEXT", "not an area"), ("TEXT", "hidden layer")]
    assert count_left_out(parts) == (
        LeftOut("CIRCLE", "hidden layer", 1),
        LeftOut("TEXT", "hidden layer", 1),
        LeftOut("TEXT", "not an area", 2),
    )
