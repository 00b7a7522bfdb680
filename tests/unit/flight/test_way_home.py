"""The way home of a mission in flight: kept or planned anew, without a take-off, proved and exported; or a hover."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from missionc.backends.api import Budget
from missionc.backends.options import Options
from missionc.base.diagnostics.code import NOT_EXPORTED
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.replan_summary import replanned_document, replanned_lines
from missionc.compiler import driver
from missionc.compiler.plan_ways import plan_ways
from missionc.compiler.replan.replan import way_home
from missionc.compiler.replan.request import Replanned, Way
from missionc.ir import Disc, Mission, Prism
from missionc.ir.kernel.nodes import Kernel
from missionc.output.documents.whole_flight_json import whole_flight_json
from missionc.output.export.formats import FORMATS, Exported, flight
from missionc.output.output_files import WholeFlight
from missionc.planning.progression.past_document import read_past
from missionc.planning.progression.stretches import Remaining, Stretch, after
from missionc.tools.api.replan_folder import replan_folder
from missionc.tools.replay.reverify import reverify
from missionc.verification.flight.verify_whole_flight import pieces_of, verify_whole_flight, whole_phases
from missionc.verification.flight.way_missions import Stage, has_risen, is_whole, ways_of
from missionc.verification.monitoring.read_trace import read_trace
from tests.support.hall_flights import HALL, compiled, mission
from tests.support.legal_plans import still

POLE = still(Disc((1.1, 3.8), 0.3, Prism(0.0, 2.5)), "pole")


def texts(stage: str = "") -> dict[str, str]:
    return {agent.name: compiled()[f"crazyflie/{stage}drone{agent.index}.csv"].decode() for agent in mission().agents}


@cache
def trace_of() -> Trace:
    trace, _ = read_trace(Source("plan.json", compiled()["plan.json"].decode()), mission(), Limits())
    assert trace is not None
    return trace


@cache
def in_flight(stays: bool = False) -> Mission:
    """What is left of the hall after two steps, its first one being lost."""
    stretch = Stretch(trace_of().part([0, 1], 0, 2), ("drone[0]",), stays=stays)
    return after(Remaining(mission(), Kernel((), ())), stretch, mission()).mission


def as_if_in_flight() -> Mission:
    """The whole mission, as if its agents had been in the air for some time when it begins."""
    agents = (replace(agent, pad=replace(agent.pad, risen=5.0)) for agent in mission().agents if agent.pad)
    return replace(mission(), agents=tuple(agents))


def test_who_is_left_has_its_pad_and_has_risen_from_it() -> None:
    rest = in_flight()
    assert [agent.name for agent in rest.agents] == ["drone[1]"]
    pad, before = rest.agents[0].pad, mission().agents[1].pad
    assert pad is not None
    assert before is not None
    assert (pad.point, pad.hover, pad.rise, pad.risen) == (before.point, before.hover, before.rise, 2.0)
    later = after(Remaining(rest, Kernel((), ())), Stretch(trace_of().part([1], 2, 5)), mission()).mission
    pad = later.agents[0].pad
    assert pad is not None
    assert (pad.point, pad.hover, pad.rise, pad.risen) == (before.point, before.hover, before.rise, 5.0)


def test_who_stood_below_its_start_goes_back_to_there() -> None:
    agents = (replace(agent, pad=replace(agent.pad, point=None, hover=None)) for agent in mission().agents if agent.pad)
    stretch = Stretch(trace_of().part([0, 1], 0, 2))
    rest = after(Remaining(replace(mission(), agents=tuple(agents)), Kernel((), ())), stretch, mission()).mission
    assert [(agent.pad.point, agent.pad.hover) for agent in rest.agents if agent.pad] == [((1, 1), 1), ((1, 2), 1)]


def test_where_no_way_home_was_found_nobody_has_a_pad() -> None:
    assert has_risen(in_flight())
    assert not is_whole(in_flight(stays=True))


def test_a_flight_that_begins_in_the_air_has_no_way_out_and_no_take_off() -> None:
    own = as_if_in_flight()
    found = plan_ways(own, texts(), Budget(math.inf))
    assert isinstance(found, WholeFlight)
    assert set(found.ways) == {Stage.HOME}
    document = json.loads(whole_flight_json(own, texts(), found.ways))
    assert [each["phase"] for each in document["phases"]] == ["mission", "home", "hover", "land"]
    assert document["agents"][0]["pad"][:2] == [1.0, 4.0]
    names = {check.name for check in found.certificate.checks}
    assert {"home flown separation", "column separation", "safe end landing"} <= names
    assert not any(name.startswith(("out flown", "rise ")) for name in names)
    flown = pieces_of(own, texts())
    assert isinstance(flown, dict)
    lasting = whole_phases(own, ways_of(own, flown), 10.0)
    assert lasting.before == 0
    assert lasting.whole == pytest.approx(10.0 + lasting.settle + lasting.sink)


def test_what_was_flown_counts_for_batteries() -> None:
    own = as_if_in_flight()
    judged = verify_whole_flight(own, texts(), {Stage.HOME: texts("home/")})
    assert judged.passed
    endurance = next(check for check in judged.checks if check.name == "whole endurance")
    whole = next(figure.value for figure in judged.figures if figure.name == "whole flight")
    assert endurance.margin == pytest.approx(own.agents[0].vehicle.endurance - 5.0 - whole)


def test_a_way_home_that_is_kept_is_judged_in_the_world_as_it_is() -> None:
    own, ways = as_if_in_flight(), {Stage.OUT: texts("out/"), Stage.HOME: texts("home/")}
    assert way_home(own, texts(), ways).passed
    blocked = way_home(replace(own, obstacles=(POLE,)), texts(), ways)
    assert {"home flown obstacle", "sink obstacle"} <= {check.name for check in blocked.failures}
    assert not way_home(own, texts(), {}).passed
    assert not way_home(own, texts(), None).checks


def test_scripts_take_nobody_off_who_is_in_the_air() -> None:
    own, ways = as_if_in_flight(), {Stage.HOME: texts("home/")}
    made = FORMATS["cflib"].export(flight(own, Kernel((), ()), trace_of(), texts(), ways, in_flight=True))
    assert isinstance(made, Exported)
    script = made.files["fly.py"].decode()
    compile(script, "fly.py", "exec")
    assert "takeoff" not in script
    assert "arming_request(True)" not in script
    assert "reset_estimators" not in script
    assert b"every vehicle is in the air" in made.files["README.md"]
    refused = FORMATS["skybrush"].export(flight(own, Kernel((), ()), trace_of(), texts(), ways, in_flight=True))
    assert isinstance(refused, Diagnostic)
    assert refused.code is NOT_EXPORTED


SHELF = """\
mission shelf
time  step 1 s, horizon 8 s
world (0, 0) to (8, 5)
region goal = box (4, 0.5) to (6, 2.9)
team drone[2] {
  vehicle  crazyflie21
  dynamics single_integrator(speed <= 2 m/s)
  start    at (1, 1), (1, 2.5)
}
require reach: every drone: eventually[0, end] goal
solve with smt { nodes = 60 }
"""
"""Its agents are faster than their vehicles, and its flight is slower than planned."""


def test_what_is_left_of_a_flight_that_was_stretched_is_planned_anew_and_verified(tmp_path: Path) -> None:
    made = driver.compile(Source("shelf.mission", SHELF), options=Options(stretch=3.0))
    assert made.files, made.findings
    folder = written(tmp_path / "shelf", dict(made.files))
    plan = json.loads((folder / "plan.json").read_text())
    assert plan["horizon"] == 24
    changed = tmp_path / "patch.mission"
    changed.write_text("region goal = box (4, 3.2) to (6, 4.8)")
    flown = flown_until(folder, 3.0)
    found = replan_folder(folder, flown, changed, ("drone[0]",), {}, (), Seconds(5.0), 0, (), Limits())
    assert found.way in (Way.REPAIRED, Way.ANEW), found.findings
    rest = written(tmp_path / "rest", dict(found.files))
    assert json.loads((rest / "manifest.json").read_text())["options"]["stretch"] == "3.0"
    again = reverify(rest)
    assert again.passed, again.findings
    assert again.opened is not None
    assert again.opened.mission.horizon == 24 - found.begins if found.begins else False


def flown_until(folder: Path, seconds: float) -> Path:
    plan = json.loads((folder / "plan.json").read_text())
    rows = [
        f"{agent['name']},{time},{','.join(map(str, point))}"
        for agent in plan["agents"]
        for time, point in zip(plan["times"], agent["position"], strict=True)
        if time <= seconds
    ]
    path = folder.parent / "flown.csv"
    axes = ",".join("xyz"[: len(plan["agents"][0]["position"][0])])
    path.write_text(f"agent,t,{axes}\n" + "\n".join(rows) + "\n")
    return path


@cache
def long_hall() -> dict[str, bytes]:
    """The folder of a hall in which there is time for a detour."""
    text = HALL.replace("horizon 8 s", "horizon 20 s").replace("eventually[0, 8 s]", "eventually[0, end]")
    made = driver.compile(Source("hall.mission", text))
    assert made.files, made.findings
    return dict(made.files)


def written(folder: Path, files: Mapping[str, bytes]) -> Path:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def replanned(tmp_path: Path, patch: str = "") -> Replanned:
    """The hall after two seconds, without its first drone."""
    folder = written(tmp_path / "hall", long_hall())
    changed = tmp_path / "patch.mission" if patch else None
    if changed is not None:
        changed.write_text(patch)
    flown = flown_until(folder, 2.0)
    return replan_folder(folder, flown, changed, ("drone[0]",), {}, (), Seconds(10.0), 0, (), Limits())


def test_a_plan_is_kept_with_its_way_home(tmp_path: Path) -> None:
    found = replanned(tmp_path)
    assert found.way is Way.KEPT
    assert found.certificate is not None
    assert "home flown obstacle" not in {check.name for check in found.certificate.checks}
    assert {"home flown world", "column world"} <= {check.name for check in found.certificate.checks}


@pytest.mark.parametrize(
    ("patch", "finds"),
    [("obstacle pole = disc at (2.5, 3) radius 0.2", True), ("obstacle roof = disc at (2, 4) radius 0.4", False)],
)
def test_the_rest_leads_home_where_it_can_and_else_ends_in_a_hover(tmp_path: Path, patch: str, finds: bool) -> None:
    found = replanned(tmp_path, patch)
    assert found.way in (Way.REPAIRED, Way.ANEW), found.findings
    files = dict(found.files)
    assert ("whole_flight.json" in files) == ("crazyflie/home/drone1.csv" in files) == finds
    assert "safe_end.json" in files
    past = read_past(files["past.json"].decode(), 1e9)
    assert not isinstance(past, str)
    assert past.flown[-1].stretch.stays == (not finds)
    assert replanned_document(found, None)["way_home_found"] == finds
    assert any("ends in a hover" in line for line in replanned_lines(found, "")) == (not finds)
    again = reverify(written(tmp_path / "rest", files))
    assert again.passed, again.findings
