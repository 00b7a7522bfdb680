"""Occupancy grids: thresholds as nav2 compares them, unknown cells that are free, wrong metadata."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("PIL")
pytest.importorskip("yaml")

from missionc.base.diagnostics.code import MAP_LEFT_OUT, MAP_UNREADABLE
from missionc.frontend.maps.map_metadata import MapMetadata
from missionc.frontend.maps.occupancy_grid import occupied_cells
from tests.support.mapped_missions import YAML, findings, meant, only, picture

HALL = picture("....", ".##.", "....", "?...")
SAID = 'obstacles from "hall.pgm"'


def occupied(shades: list[float], occupied: float, free: float, *, unknown_free: bool = False) -> list[bool]:
    row = np.array([shades])
    metadata = MapMetadata("", 1.0, occupied=occupied, free=free)
    return list(occupied_cells(row, np.ones(row.shape, dtype=bool), metadata, unknown_free)[0])


def test_a_cell_at_a_threshold_is_occupied_or_free_as_in_nav2() -> None:
    assert occupied([0, 255], 1.0, 0.0) == [True, False]
    assert occupied([0, 51, 102, 255], 0.8, 0.6) == [True, True, False, False]
    assert occupied([51, 102], 0.8, 0.4) == [True, True]
    assert occupied([51, 102], 0.8, 0.4, unknown_free=True) == [True, False]


def test_thresholds_of_one_and_zero_leave_white_free_and_black_occupied(tmp_path: Path) -> None:
    metadata = YAML.replace("0.65", "1.0").replace("0.196", "0.0")
    shades = picture("....", ".##.", "....", "....").replace(b"\xfe", b"\xff")
    mission = meant(tmp_path, SAID, {"hall.pgm": shades, "hall.yaml": metadata})
    assert len(mission.obstacles) == 1


def test_unknown_cells_that_count_as_free_earn_a_warning(tmp_path: Path) -> None:
    files = {"hall.pgm": HALL, "hall.yaml": YAML.replace("0.196", "0.25")}
    finding = only(tmp_path, SAID, files)
    assert finding.code is MAP_LEFT_OUT
    assert "1 cell of shade 205" in finding.message
    assert "`free_thresh` is 0.25" in finding.message
    assert findings(tmp_path, f"{SAID} unknown free", files) == []
    assert findings(tmp_path, SAID, {"hall.pgm": HALL, "hall.yaml": YAML}) == []


@pytest.mark.parametrize(
    ("line", "words", "help_"),
    [
        ("origin: [0.0, 0.0, -nan]", "`-nan` is not a number", "write the yaw `0.0`"),
        ("origin: {x: 1, y: 2}", "an origin `[x, y, yaw]`", "map_saver"),
        ("origin: 4", "an origin `[x, y, yaw]`", "map_saver"),
        ("origin: [[1], 2, 3]", "a sequence is not a number", "plain number"),
        ("origin: [1_0, 2, 3]", "`1_0` is not a number", "plain number"),
        ("resolution: [0.5]", "a sequence is not a number", "plain number"),
        ("resolution: {a: 0.5}", "a mapping is not a number", "plain number"),
        ("image: [hall.pgm]", "missing key `image`", "map_saver"),
        ("negate: 0\nnegate: 0", "duplicate key `negate`", "delete one"),
        ("occupied_thresh: ~x", "`~x` is not a number", "plain number"),
    ],
)
def test_metadata_that_is_slightly_wrong_is_named_at_its_line(
    tmp_path: Path, line: str, words: str, help_: str
) -> None:
    key = line.partition(":")[0]
    lines = [line if each.startswith(key) else each for each in YAML.splitlines()]
    finding = only(tmp_path, 'obstacles from "hall.pgm"', {"hall.pgm": HALL, "hall.yaml": "\n".join(lines)})
    assert finding.code is MAP_UNREADABLE
    assert words in finding.message
    assert help_ in finding.help
    assert finding.primary is not None
    assert finding.primary.span.source.name.endswith("hall.yaml")
    assert finding.primary.span.text in line
