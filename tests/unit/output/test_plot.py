"""The map: that it is drawn, the same each time, and refused kindly where matplotlib is missing."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from missionc import ir
from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.plot.plot import COLOURS, lane_lines, name_place, plot
from missionc.output.plot.silhouette import View, silhouette_point
from missionc.verification.plan.obstacle_bodies import solid
from tests.support.legal_plans import SPAN, mission_of, moving, still, straight, wandering

CUT = ir.Difference(ir.Polygon(((6.0, 6.0), (9.0, 6.0), (9.0, 9.0), (6.0, 9.0))), ir.Disc((7.5, 7.5), 1.0))


def scene(agents: int = 3) -> tuple[ir.Mission, object]:
    position = wandering(0, agents, 4)
    obstacles = [still(ir.Box((0.5, 0.5), (1.0, 1.0))), moving(ir.Disc((2.0, 2.0), 0.3), [0.0, 4.0], [(0, 0), (3, 1)])]
    mission = mission_of(position[:, 0].tolist(), 4, obstacles=obstacles)
    regions = (ir.Region("base", ir.Disc((5.0, 5.0), 1.0), SPAN), ir.Region("wet", CUT, SPAN))
    beacons = (ir.Beacon("mast", (8.0, 2.0), SPAN),)
    return replace(mission, regions=regions, beacons=beacons), straight(position)


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_plan_gives_the_same_picture(kind: str) -> None:
    mission, trace = scene()
    first, second = plot(mission, trace, "smt", kind), plot(mission, trace, "smt", kind)  # type: ignore[arg-type]
    assert isinstance(first, bytes)
    assert first == second
    assert first.startswith(b"\x89PNG" if kind == "png" else b"<?xml")


def test_the_map_is_well_formed_and_without_a_date() -> None:
    mission, trace = scene()
    picture = plot(mission, trace, "smt", "svg")  # type: ignore[arg-type]
    assert isinstance(picture, bytes)
    ElementTree.fromstring(picture)
    assert b"dc:date" not in picture
    for colour in COLOURS[:3]:
        assert colour.lower().encode() in picture.lower()


def test_a_crowd_and_a_single_agent_are_drawn() -> None:
    for agents in (1, 20):
        mission, trace = scene(agents)
        assert isinstance(plot(mission, trace, "smt", "svg"), bytes)  # type: ignore[arg-type]


def test_a_volume_is_drawn_from_above_and_from_the_side() -> None:
    position = wandering(0, 2, 3, dimension=3)
    shapes = [
        ir.Ball((5.0, 5.0, 5.0), 1.0),
        ir.Disc((2.0, 2.0), 1.0, ir.Prism(1.0, 4.0)),
        ir.Union(ir.Box((7.0, 7.0, 0.0), (8.0, 8.0, 3.0)), ir.Ball((7.0, 7.0, 3.0), 0.5)),
        ir.Polygon(((0.0, 8.0), (1.0, 8.0), (0.0, 9.0)), ir.Prism(0.0, 2.0)),
    ]
    obstacles = [still(shape, f"thing{index}") for index, shape in enumerate(shapes)]
    mission = mission_of(position[:, 0].tolist(), 3, obstacles=obstacles)
    picture = plot(mission, straight(position), "", "svg")
    assert isinstance(picture, bytes)
    assert picture.count(b'id="axes_') == 2


def test_a_name_stands_inside_its_shape() -> None:
    world = ir.World((0.0, 0.0), (10.0, 10.0), SPAN)
    ring = ir.Difference(ir.Disc((5.0, 5.0), 3.0), ir.Disc((5.0, 5.0), 2.0))
    for shape in (CUT, ring, ir.Box((1.0, 1.0), (2.0, 2.0))):
        place = silhouette_point(world, View(0, 1), shape)
        assert solid(shape, 2)(straight([[place, place]]).position[0])[0] < 0


def test_a_name_gives_way_to_a_path_through_the_middle_of_its_shape() -> None:
    world, box = ir.World((0.0, 0.0), (10.0, 10.0), SPAN), ir.Box((2.0, 2.0), (8.0, 8.0))
    through = np.array([[[0.0, 5.0], [10.0, 5.0]]])
    assert name_place(world, View(0, 1), box, "base", 0.2, through + np.array([0.0, 3.0])) == (5.0, 5.0)
    across, up = name_place(world, View(0, 1), box, "base", 0.2, through)
    assert across == 5.0
    assert 0.15 < abs(up - 5.0) < 1.0


def test_a_name_that_finds_no_room_stays_in_the_middle() -> None:
    world, box = ir.World((0.0, 0.0), (10.0, 10.0), SPAN), ir.Box((4.8, 4.8), (5.2, 5.2))
    through = np.array([[[0.0, 5.0], [10.0, 5.0]]])
    assert name_place(world, View(0, 1), box, "base", 0.2, through) == (5.0, 5.0)


def test_paths_along_the_same_segment_lie_beside_each_other() -> None:
    shared = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]
    paths = np.array([shared, shared[::-1], [[0.0, 5.0], [1.0, 5.0], [1.0, 5.0]]])
    shifts = lane_lines(paths, 0.1)
    assert shifts[0] == pytest.approx(np.array([[0.0, -0.05]] * 3))
    assert shifts[1] == pytest.approx(np.array([[0.0, 0.05]] * 3))
    assert not shifts[2].any()


def test_a_path_keeps_its_side_around_a_corner() -> None:
    corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 1.0]]
    shifts = lane_lines(np.array([corner, corner]), 0.2)
    # Outside of the bend all the way, by a little less at the corners.
    assert shifts[0, 0] == pytest.approx([0.0, -0.1])
    assert shifts[0, 1] == pytest.approx([0.05, -0.05])
    assert shifts[0, 2] == pytest.approx([0.05, 0.05])
    assert shifts[0, 4] == pytest.approx([0.0, 0.1])
    assert shifts[1] == pytest.approx(-shifts[0])


def test_without_matplotlib_the_way_to_get_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.output.plot.plot.find_spec", lambda name: None)
    mission, trace = scene()
    found = plot(mission, trace, "smt", "svg")  # type: ignore[arg-type]
    assert isinstance(found, Diagnostic)
    assert found.code is EXTRA_MISSING
    assert "missionc[viz]" in found.help


def test_writing_outputs_loads_no_matplotlib_unless_a_map_is_asked_for() -> None:
    code = "import missionc.output.output_files, missionc.output.plot.plot, sys; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
