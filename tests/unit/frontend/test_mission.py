"""Missions built in Python: every declaration, what is read from text, and findings at the lines that built a part."""

from __future__ import annotations

from pathlib import Path

import pytest

import missionc
from missionc.frontend.builder.mission import Mission
from tests.support.small_missions import SMALL

DELIVERY = """\
mission delivery
param T = 20 s
time  step 0.5, horizon T
world (0, 0) to (10, 10)
region   base  = box (0.5, 0.5) to (2.5, 2.5)
region   field = polygon (3, 3), (4, 3.2), (3.6, 4.2)
obstacle ridge = box (3, 7) to (4, 9)
obstacle crowd = disc at (8, 3) radius 0.5 moving (0.1, 0) uncertain 0.05
obstacle train = box (8, 8) to (9, 9) along (0: 0, 0), (4: 0, -3)
beacon   mast  = (1.5, 1.5)
team drone[5] {
  radius   0.1
  dynamics unicycle(speed 0..2)
  start    in base
  vehicle  crazyflie21 { speed <= 0.8 height 0.5..2 }
  flight   { pads at (1, 1), (2, 1) hover 1 rise <= 0.3 }
}
agent scout {
  altitude 2
  dynamics single_integrator(speed <= 3 m/s)
  start    at (8, 1)
  finish   line (8, 1) to (9, 1)
  yaw      along path
}
group east = drone[0..2], scout
graph     radio = proximity 1.2 over drone
graph     net   = proximity { scout to drone 8 } weight delay 2 { scout to drone 1 }
formation wall  = line of drone spacing 0.8 total tolerance 0.1
formation vee   = offsets of east (0, 0), (-1, 1) tolerance 0.1
formation pair  = distances of drone (0 - 1: 0.8) tolerance 0.1
resource battery of drone { start 60, capacity 100, drain 0.5 per s, refill 12 per s in base }
flag     loaded  of drone { set in field, cleared in base }
separation 0.1
clearance  0.05
tolerate delay 2 of drone
let safe = not field
require watch: scout: eventually[0, T] safe
prefer  calm:  every east: always[0, T] speed <= 1.5 weight 2
minimize distance
solve with smt { nodes = 110, connectivity = lambda2, roadmap = "lanes.graphml" }
obstacles from "hall.yaml" height 0..3 resolution 5 cm origin (8.5 deg, 47.3 deg) layer "A", "B" named hall
include "site.mission"
"""


def delivery() -> Mission:
    m = Mission("delivery")
    horizon = m.param("T", "20 s")
    m.time(step=0.5, horizon=horizon)
    m.world((0, 0), (10, 10))
    base = m.region("base", missionc.box((0.5, 0.5), (2.5, 2.5)))
    field = m.region("field", missionc.polygon((3, 3), (4, 3.2), (3.6, 4.2)))
    m.obstacle("ridge", "box (3, 7) to (4, 9)")
    m.obstacle("crowd", missionc.disc((8, 3), 0.5), moving=(0.1, 0), uncertain=0.05)
    m.obstacle("train", missionc.box((8, 8), (9, 9)), along=[(0, 0, 0), (4, 0, -3)])
    m.beacon("mast", (1.5, 1.5))
    drone = m.team(
        "drone",
        5,
        dynamics=missionc.unicycle(speed=(0, 2)),
        start=base,
        radius=0.1,
        vehicle=("crazyflie21", {"speed": 0.8, "height": (0.5, 2)}),
        flight={"pads": [(1, 1), (2, 1)], "hover": 1, "rise": 0.3},
    )
    scout = m.agent(
        "scout",
        dynamics="single_integrator(speed <= 3 m/s)",
        start=(8, 1),
        finish="line (8, 1) to (9, 1)",
        altitude=2,
        yaw="along path",
    )
    east = m.group("east", drone[0:3], scout)
    m.graph("radio", "proximity", 1.2, over=drone)
    m.graph("net", "proximity", pairs={(scout, drone): 8}, weights={"delay": (2, {(scout, drone): 1})})
    m.formation("wall", "line", of=drone, spacing=0.8, tolerance=0.1, total=True)
    m.formation("vee", "offsets", of=east, offsets=[(0, 0), (-1, 1)], tolerance=0.1)
    m.formation("pair", "distances", of=drone, distances={(0, 1): 0.8}, tolerance=0.1)
    m.resource("battery", drone, start=60, capacity=100, drain={"s": 0.5}, refill={base: 12})
    m.flag("loaded", drone, set=field, cleared=base)
    m.separation(0.1)
    m.clearance(0.05)
    m.tolerate_delay(2, of=drone)
    safe = m.let("safe", ~field)
    m.require(scout.satisfies(safe.eventually(0, horizon)), "watch")
    m.prefer(east.every((missionc.state.speed <= 1.5).always(0, horizon)), "calm", weight=2)
    m.minimize("distance")
    m.solve("smt", nodes=110, connectivity="lambda2", roadmap="lanes.graphml")
    m.obstacles_from(
        "hall.yaml", height=(0, 3), resolution="5 cm", origin=("8.5 deg", "47.3 deg"), layer=["A", "B"], named="hall"
    )
    m.include("site.mission")
    return m


def test_every_declaration_prints_as_fmt_writes_it() -> None:
    assert [line.split() for line in str(delivery()).splitlines()] == [line.split() for line in DELIVERY.splitlines()]
    assert str(Mission.from_text(str(delivery()))) == str(delivery())


def test_a_mission_that_is_read_keeps_its_comments_and_can_go_on_in_python(tmp_path: Path) -> None:
    path = tmp_path / "small.mission"
    path.write_text(SMALL + "# the end\n", encoding="utf-8")
    mission = Mission.read(path)
    assert "# the end" in str(mission)
    mission.require(mission["drone"].some(mission["base"].always(0, 1)), "guard")
    assert str(mission).endswith("# the end\n\nrequire guard: some drone: always[0, 1] base\n")
    assert missionc.check(mission).ok
    with pytest.raises(KeyError, match="nothing"):
        mission["nothing"]


def test_a_text_with_an_error_of_syntax_is_refused_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"(?s)MC\d+.*text\.mission:2:8"):
        Mission.from_text("mission a\nregion = box\n")
    with pytest.raises(ValueError, match="MC"):
        Mission.read(tmp_path / "absent.mission")


def small() -> Mission:
    """A mission with an error in a text."""
    m = Mission("small")
    m.time(step=1, horizon=6)
    m.world((0, 0), (4, 4))
    base = m.region("base", missionc.box((0.2, 0.2), (1.8, 1.8)))
    drone = m.team("drone", 2, dynamics=missionc.single_integrator(speed=2), start=base)
    late = base.eventually(0, 6)
    m.require(
        drone.every(late),
        "visit",
    )
    m.require("every drone: always[0, 1 s] gaol", "stay")
    return m


def test_findings_point_at_the_python_that_built_the_part_and_at_the_text() -> None:
    mission = small()
    checked = missionc.check(mission)
    found = {finding.code.name: finding for finding in checked.findings}
    assert found.keys() == {"MC101"}
    primary = found["MC101"].primary
    assert primary is not None
    assert primary.span.source.name.endswith("test_mission.py")
    assert primary.span.text == 'm.require("every drone: always[0, 1 s] gaol", "stay")'
    (text,) = found["MC101"].labels[-1:]
    assert (text.span.source.name, text.span.text) == ("small.mission", "gaol")
    assert text.span.source.text == str(mission)
    assert "tests/unit/frontend/test_mission.py" in str(found["MC101"])


def test_a_finding_of_a_part_made_in_another_line_points_there() -> None:
    m = Mission.from_text(SMALL)
    late = m["goal"].eventually(0, 9)
    m.require(m["drone"].every(late), "late")
    (finding,) = missionc.check(m).findings
    assert finding.primary is not None
    assert finding.code.name == "MC301"
    assert finding.primary.span.text == 'm["goal"].eventually(0, 9)'


def test_a_finding_of_text_that_was_read_points_at_its_file(tmp_path: Path) -> None:
    path = tmp_path / "small.mission"
    path.write_text("# first\n\n\n" + SMALL.replace("goal\n", "gaol\n"), encoding="utf-8")
    finding = next(each for each in missionc.check(Mission.read(path)).findings if each.code.name == "MC101")
    assert finding.primary is not None
    assert finding.primary.span.source.name == str(path)
    assert finding.primary.span.source.place(finding.primary.span.start)[0] == 15


def test_code_without_a_text_leaves_findings_at_the_text_of_the_mission() -> None:
    names: dict[str, Mission] = {}
    exec("import missionc\nm = missionc.Mission('a')\nm.world((0, 0), (0, 4))\n", names)
    findings = missionc.check(names["m"]).findings
    assert findings
    assert {each.primary.span.source.name for each in findings if each.primary} == {"a.mission"}
