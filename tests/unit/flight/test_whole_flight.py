"""The whole flight: planned from the floor to the floor, proved from files alone, and flown by every export."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.backends.api import Budget
from missionc.base.diagnostics.code import NO_WAY
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.cli.app import main
from missionc.compiler.plan_ways import one_by_one, plan_ways
from missionc.flight.trajectories.stop_and_hover import state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.ir import PLAIN, Disc, Mission, Obstacle, Pad, Prism
from missionc.ir.kernel.nodes import Kernel
from missionc.output.documents.whole_flight_json import whole_flight_json
from missionc.output.export.formats import FORMATS, Exported, flight
from missionc.output.export.takeoff_and_landing import GROUND, floor_to_floor, phases
from missionc.output.output_files import WholeFlight
from missionc.verification.flight.verify_whole_flight import verify_whole_flight
from missionc.verification.flight.way_missions import Stage, Way, Ways, way_mission, ways_of
from missionc.verification.monitoring.read_trace import read_trace
from tests.support.forged_folders import changed, forged
from tests.support.hall_flights import compiled, mission
from tests.support.legal_plans import SPAN, moving, still

KERNEL = Kernel((), ())


def trace_of() -> Trace:
    """The plan of the folder, which no export of raw pieces looks at."""
    trace, _ = read_trace(Source("plan.json", compiled()["plan.json"].decode()), mission(), Limits())
    assert trace is not None
    return trace


def texts(stage: str = "") -> dict[str, str]:
    names = {agent.name: f"drone{agent.index}.csv" for agent in mission().agents}
    return {name: compiled()[f"crazyflie/{stage}{file}"].decode() for name, file in names.items()}


def pieces(texts_of: dict[str, str]) -> dict[str, Pieces]:
    found = {name: read(text) for name, text in texts_of.items()}
    return {name: own for name, own in found.items() if isinstance(own, Pieces)}


def ways() -> Ways:
    return {Stage.OUT: texts("out/"), Stage.HOME: texts("home/")}


def loaded(name: str) -> Any:
    return json.loads(compiled()[name])


def failed(with_mission: Mission, of_ways: Ways | None = None) -> set[str]:
    """The names of the checks that do not pass."""
    judged = verify_whole_flight(with_mission, texts(), ways() if of_ways is None else of_ways)
    return {check.name for check in judged.failures}


# ---------------------------------------------------------------------- the ways


def test_a_way_leads_from_above_the_pad_to_the_start_and_another_one_home() -> None:
    flown, out, home = (pieces(texts(stage)) for stage in ("", "out/", "home/"))
    for agent, pad in zip(mission().agents, ((1, 4, 0.8), (2, 4, 0.8)), strict=True):
        begin, end = (state_at(out[agent.name], time)[0, :3] for time in (0.0, math.inf))
        assert begin == pytest.approx(pad, abs=1e-6)
        assert end == pytest.approx(state_at(flown[agent.name], 0.0)[0, :3], abs=1e-5)
        begin, end = (state_at(home[agent.name], time)[0, :3] for time in (0.0, math.inf))
        assert begin == pytest.approx(state_at(flown[agent.name], math.inf)[0, :3], abs=1e-5)
        assert end == pytest.approx(pad, abs=1e-5)


def test_everybody_is_at_rest_between_the_phases() -> None:
    for stage in ("", "out/", "home/"):
        for own in pieces(texts(stage)).values():
            for time in (0.0, math.inf):
                assert state_at(own, time)[1:4] == pytest.approx(0, abs=1e-4)


def test_phases_follow_each_other_on_the_clock_of_the_mission() -> None:
    whole = loaded("whole_flight.json")
    phases = whole["phases"]
    assert [each["phase"] for each in phases] == ["rise", "hover", "out", "mission", "home", "hover", "land"]
    for before, after in pairwise(phases):
        assert before["end"] == pytest.approx(after["begin"], abs=2e-6)
    assert phases[3]["begin"] == 0
    assert phases[3]["end"] == pytest.approx(mission().horizon, abs=1e-5)
    assert whole["seconds"] == pytest.approx(phases[-1]["end"] - phases[0]["begin"], abs=2e-6)
    # 0.8 m at 0.3 m/s at most, on the polynomial whose peak is 35/16 of the mean.
    assert phases[0]["end"] - phases[0]["begin"] == pytest.approx(0.8 * 35 / 16 / 0.3, abs=0.11)
    assert [each["pad"] for each in whole["agents"]] == [[1, 4, 0], [2, 4, 0]]


def test_the_time_of_the_whole_flight_is_in_the_certificate_and_held_against_the_battery() -> None:
    certificate, whole = loaded("certificate.json"), loaded("whole_flight.json")
    (lasts,) = [each["value"] for each in certificate["figures"] if each["name"] == "whole flight"]
    assert lasts == pytest.approx(whole["seconds"], abs=1e-5)
    tired = tuple(replace(agent, vehicle=replace(agent.vehicle, endurance=lasts - 0.5)) for agent in mission().agents)
    assert failed(replace(mission(), agents=tired)) == {"whole endurance"}


# ----------------------------------------------------------------------- the proof


def test_a_folder_with_a_whole_flight_is_verified_from_its_files_alone(tmp_path: Path) -> None:
    assert main(["verify", str(forged(tmp_path, compiled()))]) == 0


def turned(table: Any) -> Any:
    table[:, 25] += 0.1
    return table


def aside(table: Any) -> Any:
    table[:, 1] += 0.05
    return table


def later(table: Any) -> Any:
    table[:, 0] *= 1.1
    return table


@pytest.mark.parametrize("change", [turned, aside, later])
@pytest.mark.parametrize("stage", ["out", "home"])
def test_a_way_that_was_changed_is_refused(tmp_path: Path, stage: str, change: Any) -> None:
    files = changed(compiled(), f"crazyflie/{stage}/drone1.csv", change)
    assert main(["verify", str(forged(tmp_path, files))]) == 5


@pytest.mark.parametrize("name", ["whole_flight.json", "crazyflie/out/drone0.csv", "crazyflie/home/drone1.csv"])
def test_a_file_of_the_whole_flight_that_is_missing_is_refused(tmp_path: Path, name: str) -> None:
    files = {other: content for other, content in compiled().items() if other != name}
    manifest = json.loads(files["manifest.json"])
    del manifest["files"][name]
    files["manifest.json"] = json.dumps(manifest).encode()
    assert main(["verify", str(forged(tmp_path, files))]) == 5


def test_phases_that_are_not_those_of_the_polynomials_are_refused(tmp_path: Path) -> None:
    text = compiled()["whole_flight.json"].decode()
    shorter = re.sub(r'"seconds": [\d.]+', '"seconds": 12.5', text)
    assert shorter != text
    assert main(["verify", str(forged(tmp_path, {**compiled(), "whole_flight.json": shorter.encode()}))]) == 5


def test_what_stands_in_a_way_or_a_column_fails_the_proof() -> None:
    def beside(*obstacles: Obstacle) -> Mission:
        return replace(mission(), obstacles=obstacles)

    def pole(x: float, y: float, radius: float = 0.1) -> Disc:
        return Disc((x, y), radius, Prism(0.0, 2.5))

    assert failed(beside(still(pole(1, 2.5), "pole"))) == {"out flown obstacle"}
    assert failed(beside(still(pole(2.5, 2.9), "pole"))) == {"home flown obstacle"}
    assert failed(beside(still(Disc((1, 4), 0.3, Prism(0.0, 0.3)), "table"))) == {"rise obstacle", "sink obstacle"}
    assert failed(beside(still(pole(5, 5), "pole"))) == set()


def test_an_obstacle_counts_where_it_is_in_each_phase() -> None:
    table, away = Disc((1, 4), 0.3, Prism(0.0, 0.3)), (4.0, 1.5, 0.0)
    horizon = float(mission().horizon)

    def of(*offsets: tuple[float, float, float]) -> Mission:
        times = (0.0, horizon / 2)
        return replace(mission(), obstacles=(moving(table, times, offsets),))

    assert failed(of((0.0, 0.0, 0.0), away)) == {"rise obstacle"}
    assert failed(of(away, (0.0, 0.0, 0.0))) == {"sink obstacle"}
    # It is below the pad while nobody is near, and gone before they land.
    there_and_gone = moving(table, (0.0, 3.0, 6.0), (away, (0.0, 0.0, 0.0), away))
    assert failed(replace(mission(), obstacles=(there_and_gone,))) == set()


def test_what_grows_is_on_the_way_home_as_large_as_it_is_at_its_end() -> None:
    post = Obstacle("post", Disc((4.5, 4), 0.1, Prism(0.0, 2.5)), still(Disc((0, 0), 1), "x").motion, SPAN, 0.0)
    assert failed(replace(mission(), obstacles=(post,))) == set()
    assert failed(replace(mission(), obstacles=(replace(post, growth=0.2),))) == {
        "home flown obstacle",
        "sink obstacle",
    }


def test_pads_that_are_too_near_fail_the_proof() -> None:
    agents = list(mission().agents)
    pad = agents[1].pad
    assert pad is not None
    agents[1] = replace(agents[1], pad=replace(pad, point=(1.3, 4.0)))
    assert "column separation" in failed(replace(mission(), agents=tuple(agents)))
    agents[1] = replace(agents[1], pad=replace(pad, point=(2.0, 5.9)))
    assert "column world" in failed(replace(mission(), agents=tuple(agents)))


def test_a_way_that_nobody_flies_has_to_be_one_that_nobody_needs() -> None:
    assert failed(mission(), {Stage.HOME: texts("home/")}) == {"out way"}
    stay = tuple(replace(agent, pad=Pad(None, SPAN)) for agent in mission().agents)
    assert failed(replace(mission(), agents=stay), {Stage.HOME: texts("home/")}) == {"home end"}


# --------------------------------------------------------------------- planning


def planned(with_mission: Mission) -> WholeFlight | Diagnostic | None:
    return plan_ways(with_mission, texts(), Budget(math.inf))


def test_nothing_is_planned_where_no_team_says_that_it_comes_from_the_floor() -> None:
    found = planned(replace(mission(), agents=tuple(replace(agent, pad=None) for agent in mission().agents)))
    assert isinstance(found, WholeFlight)
    assert not found.ways
    assert found.stops
    plain = tuple(replace(agent, pad=None, vehicle=PLAIN) for agent in mission().agents)
    assert planned(replace(mission(), agents=plain)) is None


def test_who_rises_below_its_start_needs_no_way_out() -> None:
    found = planned(replace(mission(), agents=tuple(replace(agent, pad=Pad(None, SPAN)) for agent in mission().agents)))
    assert isinstance(found, WholeFlight)
    assert set(found.ways) == {Stage.HOME}


def test_pads_in_the_other_order_are_reached_without_meeting() -> None:
    agents = list(mission().agents)
    pads = [agent.pad for agent in agents]
    crossed = tuple(replace(agent, pad=pad) for agent, pad in zip(agents, reversed(pads), strict=True))
    found = planned(replace(mission(), agents=crossed))
    assert isinstance(found, WholeFlight)
    assert found.certificate.passed


def test_where_straight_ways_meet_agents_can_go_one_after_the_other() -> None:
    begin, end = np.array([(2, 2.5, 1), (2, 0.5, 1)], float), np.array([(1, 1, 1), (1, 2, 1)], float)
    position = one_by_one(mission(), Stage.OUT, Way(begin, end, np.zeros(2)), 4.0)
    assert position is not None
    assert np.array_equal(position[:, 0], begin)
    assert np.array_equal(position[:, -1], end)
    assert ((np.abs(np.diff(position, axis=1)).max(axis=-1) > 0).sum(axis=0) == 1).all()


def test_nobody_goes_where_each_stands_in_the_way_of_the_other() -> None:
    begin = np.array([(1, 1, 1), (3, 1, 1)], float)
    assert one_by_one(mission(), Stage.OUT, Way(begin, begin[::-1], np.zeros(2)), 4.0) is None


def test_a_way_leads_round_what_stands_in_it() -> None:
    wall = still(Disc((1.5, 3.0), 0.4, Prism(0.0, 2.5)), "pillar")
    around = replace(mission(), obstacles=(wall,))
    assert "out flown obstacle" in failed(around)
    found = planned(around)
    assert isinstance(found, WholeFlight)
    assert found.certificate.passed


def test_no_way_is_said_with_what_came_nearest() -> None:
    from missionc.ir import Box

    wall = still(Box((0.0, 2.8, 0.0), (6.0, 3.2, 2.5)), "wall")
    found = plan_ways(replace(mission(), obstacles=(wall,)), texts(), Budget(0.0))
    assert isinstance(found, Diagnostic)
    assert found.code is NO_WAY
    assert "from above the pads to the starts" in found.message
    assert found.primary is not None
    assert found.primary.span.text.startswith("flight")


def test_a_way_keeps_the_clearance_and_the_bodies_of_its_mission() -> None:
    flown = pieces(texts())
    way = ways_of(mission(), flown)[Stage.OUT]
    made = way_mission(replace(mission(), clearance=Metres(0.3)), Stage.OUT, way, 5.0, 2, 1.0)
    assert (made.clearance, made.separation, made.requirements) == (0.3, mission().separation, ())
    assert [agent.vehicle for agent in made.agents] == [agent.vehicle for agent in mission().agents]


# ----------------------------------------------------------------- rising in turns


def staggered() -> Mission:
    """Pads too near to rise from at once, and hovers one well above the other."""
    agents = []
    for agent, point, hover in zip(mission().agents, ((1.0, 4.0), (1.32, 4.0)), (1.6, 0.6), strict=True):
        assert agent.pad is not None
        agents.append(replace(agent, pad=replace(agent.pad, point=point, hover=hover)))
    return replace(mission(), agents=tuple(agents))


@cache
def in_turns() -> WholeFlight:
    found = planned(staggered())
    assert isinstance(found, WholeFlight), found
    return found


def test_from_pads_that_are_too_near_agents_rise_in_turns_and_land_the_other_way_round() -> None:
    document = json.loads(whole_flight_json(staggered(), texts(), in_turns().ways))
    assert document["turns"] == [["drone[0]"], ["drone[1]"]]
    rise, land = document["phases"][0], document["phases"][-1]
    # The higher one takes 1.6 m at 0.3 m/s at most, and both as long.
    assert rise["end"] - rise["begin"] == pytest.approx(2 * 1.6 * 35 / 16 / 0.3, abs=0.21)
    lasting = phases(flight(staggered(), KERNEL, trace_of(), texts(), in_turns().ways))
    assert land["end"] - land["begin"] == pytest.approx(2 * lasting.sink, abs=1e-5)
    assert document["seconds"] == pytest.approx(lasting.whole, abs=1e-4)


def test_a_show_and_the_scripts_rise_in_these_turns() -> None:
    flown = flight(staggered(), KERNEL, trace_of(), texts(), in_turns().ways)
    first, second = floor_to_floor(flown)
    lasting = phases(flown, GROUND)
    half = [state_at(own, lasting.rise)[0, 2] for own in (first, second)]
    assert half == pytest.approx([1.6, 0.0], abs=1e-5)
    end = float(first.times[-1]) - lasting.sink
    assert [state_at(own, end)[0, 2] for own in (first, second)] == pytest.approx([1.6, 0.0], abs=1e-4)
    for time in np.linspace(0.0, float(first.times[-1]), 400):
        here, there = (state_at(own, time)[0, :3] for own in (first, second))
        sideways, height = math.hypot(*(here - there)[:2]), abs(here[2] - there[2])
        on_the_floor = min(here[2], there[2]) < 1e-6
        assert sideways >= 0.3 if on_the_floor else (sideways / 0.4) ** 2 + (height / 0.7) ** 2 >= 1
    made = FORMATS["crazyswarm2"].export(flown)
    assert isinstance(made, Exported)
    assert b"for turn in ((0,), (1,))]" in made.files["fly.py"]


# ------------------------------------------------------------- what is drawn


def test_the_report_draws_the_phases_the_ways_and_the_pads() -> None:
    text = compiled()["report.html"].decode()
    data = json.loads(text.partition('<script type="application/json" id="data">')[2].partition("</script>")[0])
    phases = loaded("whole_flight.json")["phases"]
    assert [each["phase"] for each in data["whole"]["phases"]] == [each["phase"] for each in phases]
    out, home = data["whole"]["ways"]
    assert [line[0] for line in out] == [[1, 4, 0.8], [2, 4, 0.8]]
    assert [line[-1][:2] for line in home] == [[1, 4], [2, 4]]
    assert data["whole"]["pads"] == [[1, 4, 0], [2, 4, 0]]


# --------------------------------------------------------------------- exports


def test_exports_fly_the_whole_of_it() -> None:
    show = compiled()["export/skybrush/show.skyc"]
    assert show
    whole = loaded("whole_flight.json")
    air = [each for each in whole["phases"] if each["phase"] in ("out", "mission", "home")]
    lasts = air[-1]["end"] - air[0]["begin"]
    rows = compiled()["export/px4/Drone 1.csv"].decode().splitlines()[1:]
    assert float(rows[-1].split(",")[1]) == pytest.approx(lasts, abs=1e-5)
    x, y, z = (float(value) for value in rows[0].split(",")[2:5])
    assert (x, -y, -z) == pytest.approx((1, 4, 0.8), abs=1e-6)
    script = compiled()["export/cflib/fly.py"].decode()
    duration = re.search(r"RISE, SETTLE, GO, DURATION, SINK, LAND_NOW = \((.*)\)", script)
    assert duration is not None
    rise, _, _, flown, sink, _ = map(float, duration[1].split(","))
    assert flown == pytest.approx(lasts, abs=1e-5)
    assert rise == pytest.approx(whole["phases"][0]["end"] - whole["phases"][0]["begin"], abs=1e-5)
    assert sink == pytest.approx(whole["phases"][-1]["end"] - whole["phases"][-1]["begin"], abs=1e-5)
    # What takes off is where it was proved that it may: no further from its pad than it may miss.
    assert "LANDED, NEAR = (0.04, 0.05)" in script
    readme = compiled()["export/cflib/README.md"].decode()
    begins, ends = air[0]["end"] - air[0]["begin"], air[1]["end"] - air[0]["begin"]
    assert f"the mission from `{begins:.3f}".rstrip("0").rstrip(".") in readme
    assert f"to `{ends:.3f}".rstrip("0").rstrip(".") in readme
