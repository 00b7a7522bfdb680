"""Reading of files of places: bounds that hold for every form, and silence on standard error."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("PIL")
pytest.importorskip("yaml")

from missionc.base.diagnostics.code import FILE_TOO_LARGE, MAP_FEATURE
from missionc.base.limits import Limits
from tests.support.mapped_missions import YAML, only, picture, written

NOISY = """
import logging, sys, warnings
from missionc.frontend.maps import occupancy_grid
from missionc.compiler.front_end import check

read = occupancy_grid._decoded

def noisy(*args):
    decoded = read(*args)
    warnings.warn("the picture is odd")
    logging.getLogger("PIL.PngImagePlugin").warning("the picture is odd")
    return decoded

occupancy_grid._decoded = noisy
assert check(sys.argv[1]).ok
"""


def test_what_a_library_warns_of_does_not_reach_standard_error(tmp_path: Path) -> None:
    path = written(tmp_path, 'obstacles from "hall.yaml"', {"hall.pgm": picture("#..."), "hall.yaml": YAML})
    done = subprocess.run([sys.executable, "-c", NOISY, str(path)], capture_output=True, text=True, check=True)
    assert done.stderr == ""


def test_places_beyond_the_largest_number_of_a_mission_are_refused(tmp_path: Path) -> None:
    files = {"hall.pgm": picture("#..."), "hall.yaml": YAML.replace("0.5", "1e200")}
    finding = only(tmp_path, 'obstacles from "hall.yaml"', files)
    assert finding.code is MAP_FEATURE
    assert "has coordinates above" in finding.message


def test_cells_too_small_to_be_told_apart_are_refused(tmp_path: Path) -> None:
    files = {"hall.pgm": picture("#..."), "hall.yaml": YAML.replace("0.5", "1e-300")}
    finding = only(tmp_path, 'obstacles from "hall.pgm"', files)
    assert finding.code is MAP_FEATURE
    assert "cells of 1e-300 m" in finding.message


def test_points_of_one_feature_count_towards_the_limit(tmp_path: Path) -> None:
    text = '{"type": "MultiPoint", "coordinates": [[1, 1], [2, 2], [3, 3]]}'
    finding = only(tmp_path, 'beacons from "s.json" unit 1 m', {"s.json": text}, Limits(map_features=2))
    assert finding.code is FILE_TOO_LARGE
    assert "map_features=3" in finding.help
