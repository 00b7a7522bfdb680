"""Safe ends: from every moment of a flight to rest and to the floor, proved, and refused where changed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.base.source import Source
from missionc.cli.app import main
from missionc.compiler import driver
from missionc.flight.trajectories.safe_end import safe_ends
from missionc.flight.trajectories.stop_and_hover import state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.ir import PLAIN, Disc, Mission, Prism
from missionc.ir.vehicle_profiles import profiles
from missionc.output.documents.safe_end_json import read_safe_end, safe_end_json, safe_end_noted
from missionc.verification.flight.verify_safe_end import failing_stops, has_safe_end, judge_stops, verify_safe_end
from missionc.verification.flight.verify_whole_flight import Stop, as_one, in_turns, landing_margins
from missionc.verification.flight.way_missions import Stage
from tests.support.forged_folders import forged
from tests.support.hall_flights import compiled, mission
from tests.support.legal_plans import mission_of, moving, still

CRAZYFLIE = profiles()["crazyflie21"]


def texts(stage: str) -> dict[str, str]:
    return {agent.name: compiled()[f"crazyflie/{stage}drone{agent.index}.csv"].decode() for agent in mission().agents}


@cache
def whole() -> tuple[dict[str, Pieces], float, float]:
    return as_one(mission(), texts(""), {Stage.OUT: texts("out/"), Stage.HOME: texts("home/")})


@cache
def stops() -> tuple[Stop, ...]:
    found = read_safe_end(compiled()["safe_end.json"].decode(), mission())
    assert not isinstance(found, str), found
    return found


# --------------------------------------------------------------------- what is written


def test_there_is_a_safe_end_within_a_second_of_every_moment_of_the_flight() -> None:
    flown, before, _ = whole()
    times = [stop.at for stop in stops()]
    last = float(flown["drone[0]"].times[-1]) - before
    assert times[0] == pytest.approx(-before, abs=1e-3)
    assert times[-1] == pytest.approx(last, abs=1e-3)
    longest = max(after - here for here, after in pairwise(times))
    assert longest < 1.0
    figures = {each["name"]: each["value"] for each in json.loads(compiled()["certificate.json"])["figures"]}
    assert figures["safe end wait"] == pytest.approx(longest, abs=1e-5)
    assert figures["safe end hover"] == 0


def test_a_stop_goes_on_from_the_flight_and_ends_at_rest_with_nobody_too_near() -> None:
    flown, before, _ = whole()
    need = mission().spacing(0, 1).sideways
    for stop in stops():
        for agent, own in zip(mission().agents, stop.pieces, strict=True):
            here = state_at(flown[agent.name], stop.at + before)
            here[4] *= stop is not stops()[-1]  # where the flight ends, so does its snap
            assert state_at(own, 0.0) == pytest.approx(here, abs=2e-3)
            assert state_at(own, stop.seconds * (1 - 1e-9))[1:4] == pytest.approx(0, abs=1e-3)
        for time in np.linspace(0, stop.seconds, 25).tolist():
            first, second = (state_at(own, time)[0, :3] for own in stop.pieces)
            assert np.linalg.norm((first - second)[:2]) > need or abs(first[2] - second[2]) > 0.7


def test_everybody_lands_after_every_stop_of_this_flight() -> None:
    for stop in stops():
        assert sorted(index for turn in stop.turns for index in turn) == [0, 1]
        assert min(margin for _, margin in landing_margins(mission(), stop)) >= 0


def test_what_is_read_is_what_was_written() -> None:
    assert safe_end_json(mission(), stops()) == compiled()["safe_end.json"].decode()


# ----------------------------------------------------------------------- landing in turns


def hovering(*places: tuple[float, float, float], at: float = 0.0) -> tuple[Mission, Stop]:
    """A mission whose agents hover there from a moment on."""
    made = mission_of(places, 4, dynamics=mission().agents[0].dynamics, size=6.0)
    agents = tuple(replace(agent, vehicle=CRAZYFLIE) for agent in made.agents)
    pieces = []
    for place in places:
        coefficients = np.zeros((2, 4, 8))
        coefficients[:, :3, 0] = place
        pieces.append(Pieces(np.array([0.25, 1.0]), coefficients))
    return replace(made, agents=agents, separation=made.separation), Stop(at, tuple(pieces), ())


def test_those_who_are_far_enough_apart_land_at_once() -> None:
    assert in_turns(*hovering((1, 1, 1), (2, 1, 1), (3, 1, 1))) == ((0, 1, 2),)


def test_those_above_each_other_beside_the_lower_ones_column_land_in_turns_the_lower_one_first() -> None:
    # 0.3 m apart sideways: too near for both to land at once, near enough to stand beside each other.
    assert in_turns(*hovering((1, 1, 1.6), (1.32, 1, 0.6))) == ((1,), (0,))


def test_nobody_lands_on_another() -> None:
    own, stop = hovering((1, 1, 1.6), (1.1, 1, 0.6))
    assert in_turns(own, stop) == ((1,),)


def test_nobody_lands_on_what_stands_below() -> None:
    own, stop = hovering((1, 1, 1), (3, 1, 1))
    table = still(Disc((1, 1), 0.3, Prism(0.0, 0.5)), "table")
    assert in_turns(replace(own, obstacles=(table,)), stop) == ((1,),)


def test_what_comes_before_they_are_down_counts() -> None:
    own, stop = hovering((1, 1, 1), (3, 1, 1))
    table = Disc((1, 1), 0.3, Prism(0.0, 0.5))
    comes = moving(table, (0.0, 4.0), ((0.0, 4.0, 0.0), (0.0, 0.0, 0.0)))
    goes = moving(table, (-5.0, -1.0), ((0.0, 0.0, 0.0), (0.0, 4.0, 0.0)))
    assert in_turns(replace(own, obstacles=(comes,)), stop) == ((1,),)
    assert in_turns(replace(own, obstacles=(goes,)), stop) == ((0, 1),)


def test_turns_are_those_in_which_every_margin_is_kept() -> None:
    random = np.random.default_rng(3)
    for _ in range(30):
        places = [tuple(place) for place in random.uniform((0.5, 0.5, 0.4), (2.5, 2.5, 1.9), (5, 3)).tolist()]
        own, stop = hovering(*places)
        landed = replace(stop, turns=in_turns(own, stop))
        assert all(margin >= 0 for _, margin in landing_margins(own, landed))
        for turn in landed.turns:
            for one, other in combinations(turn, 2):
                assert np.hypot(*np.subtract(places[one], places[other])[:2]) >= own.spacing(one, other).sideways


# ----------------------------------------------------------------------- the proof


def failed(with_mission: Mission, of: tuple[Stop, ...]) -> set[str]:
    flown, before, _ = whole()
    return {check.name for check in judge_stops(with_mission, flown, before, of).failures}


def test_the_stops_of_the_folder_pass() -> None:
    assert failed(mission(), stops()) == set()


def test_what_stands_where_somebody_stops_is_found() -> None:
    place = stops()[len(stops()) // 2].places[0]
    pole = Disc((float(place[0]) + 0.1, float(place[1])), 0.1, Prism(0.0, 2.5))
    beside = replace(mission(), obstacles=(still(pole, "pole"),))
    assert failed(beside, stops()) == {"flown obstacle", "landing"}


def test_what_moves_counts_where_it_is_at_the_stop() -> None:
    middle = stops()[len(stops()) // 2]
    place = middle.places[0]
    pole = Disc((float(place[0]) + 0.1, float(place[1])), 0.1, Prism(0.0, 2.5))
    away = (0.0, 30.0, 0.0)
    times = (middle.at - 0.2, middle.at - 0.1, middle.at + 60.0, middle.at + 60.1)
    here = moving(pole, times, (away, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), away))
    later = moving(pole, tuple(time + 80.0 for time in times), (away, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), away))
    assert "flown obstacle" in failed(replace(mission(), obstacles=(here,)), (middle,))
    assert failed(replace(mission(), obstacles=(later,)), (middle,)) == set()


def test_moments_without_a_stop_that_can_be_proved_are_left_out() -> None:
    flown, before, _ = whole()
    place = stops()[len(stops()) // 2].places[0]
    pole = Disc((float(place[0]) + 0.1, float(place[1])), 0.1, Prism(0.0, 2.5))
    beside = replace(mission(), obstacles=(still(pole, "pole"),))
    fewer = safe_ends(beside, flown, before, 0.0)
    assert 1 < len(fewer) < len(stops())
    assert failed(beside, fewer) == set()


def changed(change: Callable[[Any], None]) -> dict[str, bytes]:
    document = json.loads(compiled()["safe_end.json"])
    change(document)
    return {**compiled(), "safe_end.json": json.dumps(document).encode()}


def _aside(document: Any) -> None:
    document["moments"][5]["stops"][0][0] += 0.01


def _farther(document: Any) -> None:
    document["moments"][5]["stops"][0][7] += 1.0


def _slower(document: Any) -> None:
    document["moments"][5]["seconds"] *= 1.2


def _endless(document: Any) -> None:
    del document["moments"][-1]


def _fewer(document: Any) -> None:
    del document["moments"][3]


def _twice(document: Any) -> None:
    document["moments"][3]["land"].append(["drone[0]"])


def _stranger(document: Any) -> None:
    document["moments"][3]["land"] = [["drone[7]"]]


def _empty(document: Any) -> None:
    document["moments"] = []


def _numberless(document: Any) -> None:
    document["moments"][3]["stops"][0][0] = None


def _keyless(document: Any) -> None:
    del document["agents"]


@pytest.mark.parametrize(
    "change",
    [_aside, _farther, _slower, _endless, _twice, _stranger, _empty, _numberless, _keyless],
)
def test_safe_ends_that_were_changed_do_not_pass(change: Callable[[Any], None]) -> None:
    found = read_safe_end(changed(change)["safe_end.json"].decode(), mission())
    flown, before, risen = whole()
    assert isinstance(found, str) or not verify_safe_end(mission(), flown, before, risen, found).passed


@pytest.mark.parametrize("change", [_farther, _fewer, _keyless])
def test_a_folder_with_such_a_file_is_refused(tmp_path: Path, change: Callable[[Any], None]) -> None:
    assert main(["verify", str(forged(tmp_path, changed(change)))]) == 5


def test_text_that_is_no_json_is_said() -> None:
    assert isinstance(read_safe_end("{", mission()), str)


def test_polynomials_read_in_the_folder_are_those_that_were_flown() -> None:
    own = read(texts("out/")["drone[0]"])
    assert isinstance(own, Pieces)
    flown, before, risen = whole()
    assert before == pytest.approx(float(own.times[-1]))
    assert flown["drone[0]"].duration[: own.duration.size] == pytest.approx(own.duration)
    assert risen > 8


# --------------------------------------------------------------------- of missions that begin in the air

SHELF = """\
mission shelf
time  step 1 s, horizon 8 s
world (0, 0) to (6, 5)
region goal = box (4, 0.5) to (5.5, 4.5)
team drone[2] {
  vehicle  crazyflie21
  dynamics single_integrator(speed <= 0.6 m/s)
  start    at (1, 1), (1, 2.5)
}
require reach: every drone: eventually[0, 8 s] goal
solve with smt { nodes = 60 }
"""


@cache
def in_the_air() -> tuple[Mission, dict[str, bytes]]:
    made = driver.compile(Source("shelf.mission", SHELF))
    assert made.checked.mission is not None
    return made.checked.mission, dict(made.files)


def test_a_mission_with_a_vehicle_has_a_safe_end_for_every_moment_too(tmp_path: Path) -> None:
    own, files = in_the_air()
    found = read_safe_end(files["safe_end.json"].decode(), own)
    assert not isinstance(found, str)
    assert [found[0].at, found[-1].at] == pytest.approx([0, 8], abs=1e-5)
    assert all(sorted(index for turn in stop.turns for index in turn) == [0, 1] for stop in found)
    figures = {each["name"]: each["value"] for each in json.loads(files["certificate.json"])["figures"]}
    assert figures["safe end wait"] <= 1.0
    assert figures["safe end without"] == 0
    assert "whole_flight.json" not in files
    assert main(["verify", str(forged(tmp_path / "whole", files))]) == 0
    without = {name: content for name, content in files.items() if name != "safe_end.json"}
    manifest = json.loads(files["manifest.json"])
    del manifest["files"]["safe_end.json"]
    without["manifest.json"] = json.dumps(manifest).encode()
    assert main(["verify", str(forged(tmp_path / "without", without))]) == 5


def flown_in_the_air() -> dict[str, Pieces]:
    own, files = in_the_air()
    found = {agent.name: read(files[f"crazyflie/drone{agent.index}.csv"].decode()) for agent in own.agents}
    assert all(isinstance(each, Pieces) for each in found.values())
    return found  # type: ignore[return-value]


def test_for_how_long_there_is_no_safe_end_is_said() -> None:
    own, _ = in_the_air()
    flown = flown_in_the_air()
    agents = (replace(agent, vehicle=replace(CRAZYFLIE, endurance=9.0)) for agent in own.agents)
    empty = replace(own, agents=tuple(agents))
    found = safe_ends(empty, flown, 0.0, 0.0)
    assert 0 < len(found) < len(safe_ends(own, flown, 0.0, 0.0))
    certificate = verify_safe_end(empty, flown, 0.0, 0.0, found)
    assert certificate.passed
    figures = {figure.name: figure.value for figure in certificate.figures}
    assert figures["safe end without"] == pytest.approx(8 - found[-1].at, abs=1e-5)
    (note,) = safe_end_noted(certificate)
    assert re.fullmatch(r"no safe end was found for the last \S+ s; before that, a safe end starts within \S+ s", note)
    none = verify_safe_end(empty, flown, 0.0, 0.0, ())
    assert none.passed
    assert {figure.name: figure.value for figure in none.figures}["safe end without"] == pytest.approx(8, abs=1e-5)


def test_each_stop_that_fails_is_found_and_no_other() -> None:
    own, _ = in_the_air()
    flown = flown_in_the_air()
    found = safe_ends(own, flown, 0.0, 0.0)
    pole = Disc(tuple(found[len(found) // 2].places[0, :2].tolist()), 0.1)
    beside = replace(own, obstacles=(still(pole, "pole"),))
    failing = failing_stops(beside, flown, 0.0, found)
    alone = {
        number
        for number, stop in enumerate(found)
        if {check.name for check in judge_stops(beside, flown, 0.0, [stop]).failures} - {"landing"}
    }
    assert failing == alone != set()


def test_a_mission_without_vehicles_has_none() -> None:
    own, _ = in_the_air()
    assert has_safe_end(own)
    assert not has_safe_end(replace(own, agents=tuple(replace(agent, vehicle=PLAIN) for agent in own.agents)))
