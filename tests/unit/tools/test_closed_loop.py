"""Flights in a closed loop: what happens to them, what the ground hears and does, and what is kept in the end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.base.diagnostics.code import SCENARIO_UNUSABLE
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.app import main
from missionc.flight.simulation.disturbance import POSITION, VELOCITY
from missionc.flight.trajectories.stop_and_hover import progress
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.output.report.flight_tracks import flights
from missionc.output.report.page_data import Plotted, data
from missionc.tools.closed_loop.fly_loop import Listen, LoopFlight, fly_loop, nobody
from missionc.tools.closed_loop.ground import GroundStation, UploadedTrajectories, uploaded
from missionc.tools.closed_loop.loop_record import ToldPositions, loop_flights, without_path
from missionc.tools.closed_loop.reports import Reports
from missionc.tools.closed_loop.scenario import Event, Scenario, read_scenario
from tests.support.shelf_flight import flying, inspector, outcome

LIMITS = Limits()
DRONES = ("drone[0]", "drone[1]", "drone[2]")
WHOLE = """[wind]
mean = 0.2
gust = 0.1
[reports]
noise = 0.01
dropped = 0.05
late = 0.1
skew = 0.05
[[event]]
at = 8
slow = "drone[1]"
to = 0.5
[[event]]
at = 3.5
lose = "drone[0]"
[[event]]
at = 4
change = "obstacle debris = disc at (8, 2) radius 0.3"
"""


def test_a_scenario_is_read_with_its_events_in_order() -> None:
    found = read_scenario(Source("s.toml", WHOLE), DRONES)
    assert isinstance(found, Scenario)
    assert (found.wind, found.dropped, found.skew) == (0.2, 0.05, 0.05)
    assert [each.at for each in found.events] == [3.5, 4.0, 8.0]
    assert found.events[2] == Event(8.0, slow="drone[1]", to=0.5)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[wind\n", 1),
        ("[weather]\n", 1),
        ("[wind]\nmean = -1\n", 2),
        ("[reports]\ndropped = 1\n", 2),
        ("[reports]\nloud = 1\n", 1),
        ('[[event]]\nat = 1\nlose = "nobody"\n', 1),
        ("[[event]]\nat = 1\n", 1),
        ('[[event]]\nat = -1\nlose = "drone[0]"\n', 1),
        ('[[event]]\nat = 1\nlose = "drone[0]"\n[[event]]\nat = 1\nslow = "drone[0]"\nto = 2\n', 4),
        ("event = 3\n", 1),
    ],
)
def test_what_no_scenario_says_is_pointed_at(text: str, line: int) -> None:
    found = read_scenario(Source("s.toml", text), DRONES)
    assert isinstance(found, list)
    assert {each.code for each in found} == {SCENARIO_UNUSABLE}
    assert found[0].primary is not None
    assert found[0].primary.span.source.place(found[0].primary.span.start)[0] == line


def test_uploads_take_over_when_they_begin() -> None:
    pieces = [own for text in flying().flights.values() if isinstance(own := read(text), Pieces)]
    told, mover = UploadedTrajectories(pieces, np.zeros(3)), DRONES.index(inspector())
    here = Pieces(np.array([1.0, 1.0]), np.zeros((2, 4, 8)))
    told.upload(mover, here, 12.0)
    assert not np.allclose(told.setpoints(np.array([10.0]))[POSITION, 0, mover], 0.0)
    assert np.allclose(told.setpoints(np.array([12.5]))[POSITION, 0, mover], 0.0)


def test_slow_agents_stay_on_their_way_and_fall_behind_where_it_is_faster_than_they_are() -> None:
    pieces = [own for text in flying().flights.values() if isinstance(own := read(text), Pieces)]
    told, mover = UploadedTrajectories(pieces, np.zeros(3)), DRONES.index(inspector())
    times = np.arange(0.0, 20.0, 0.01)
    wanted = told.setpoints(times)[..., mover]
    most = 0.5 * float(np.linalg.norm(wanted[VELOCITY], axis=0).max())
    told.slow(mover, most)
    seen = np.concatenate([told.setpoints(part)[..., mover] for part in np.split(times, 200)], axis=1)
    assert np.linalg.norm(seen[VELOCITY], axis=0).max() < most + 1e-6
    assert np.linalg.norm(np.diff(seen[POSITION], axis=1), axis=0).max() < 0.011 * most
    last = int(np.flatnonzero(np.linalg.norm((wanted - seen)[POSITION], axis=0) > 0.2)[0])
    found = progress(pieces[mover], times[last - 100 : last + 1 : 10], seen[POSITION, last - 100 : last + 1 : 10].T)
    assert found.beside < 0.03
    assert found.behind > 0.15
    assert found.speed == pytest.approx(most, rel=0.1)
    assert found.rate < 0.9


def test_reports_are_late_and_some_never_come() -> None:
    reports = Reports(Scenario(dropped=0.5, late=1.0, noise=0.1), np.random.default_rng(0))
    silent = np.array([False, True])
    for number in range(100):
        reports.send(number / 10, np.zeros((3, 2)), np.zeros((3, 2)), np.zeros(2), silent)
    heard = reports.heard(20.0)
    assert 30 < len(heard) < 70
    assert {each.agent for each in heard} == {0}
    assert [each.time for each in heard] != sorted(each.time for each in heard)
    assert 0.05 < np.std([each.position[0] for each in heard]) < 0.2


def scenario(*events: Event) -> Scenario:
    return Scenario(0.2, 0.1, 0.01, 0.05, 0.05, 0.02, events)


def flight(*events: Event, listen: Listen = nobody) -> LoopFlight:
    return fly_loop(flying(), scenario(*events), 0, Seconds(3.0), LIMITS, clock=Seconds(3600.0), listen=listen)


def test_the_others_finish_what_a_lost_drone_has_begun() -> None:
    told, lost = ToldPositions(), Event(2.0, lose=inspector())
    alone = flight(lost, listen=told.listen)
    assert alone.lost == (inspector(),)
    assert any(each.begins is not None for each in alone.happened)
    assert alone.outcome.satisfied
    assert alone.outcome.untouched
    shown_beside_its_plan(alone, lost, told)


def shown_beside_its_plan(alone: LoopFlight, lost: Event, told: ToldPositions) -> None:
    """The page has the flight, what was uploaded, and who keeps apart from whom as long as it flies."""
    mission, own, plan = flying().checked.mission, flying(), outcome()
    assert mission is not None
    assert own.checked.kernel is not None
    loop = loop_flights(mission, scenario(lost), [alone, without_path(alone)], told, True)
    moving = flights(mission, own.trace, own.flights, loop=loop)
    assert moving.told is not None
    assert moving.simulated is not None
    gone = moving.told.times >= 2.0
    others = [number for number, name in enumerate(DRONES) if name != inspector()]
    assert np.abs(moving.told.position - moving.simulated.placed.position)[others].max() < 0.3
    here = moving.simulated.placed.there
    assert here is not None
    assert here[others].all()
    assert not here[DRONES.index(inspector()), gone].any()
    drawn = data(Plotted(mission, own.checked.kernel, plan.plan, plan.certificate, own.flights, (), loop=loop))
    assert list(drawn["motion"]) == ["planned", "told", "simulated"]
    assert drawn["loop"]["gone"] == {inspector(): 2.0}
    kept = {each["name"]: (each["held"], each["of"]) for each in drawn["loop"]["kept"]}
    assert kept == dict.fromkeys(("inspect", "home", "all of them", "nothing touched"), (2, 2))
    first, second = drawn["loop"]["flights"]
    assert first["told"] == second["told"]
    assert {each["by"] for each in first["told"]} == {"event", "ground", "plan", "nearest"}
    begun = next(each.begins for each in alone.happened if each.begins is not None)
    assert begun in [each["t"] for each in first["told"] if each["by"] == "plan"]
    assert [each["name"] for each in drawn["checks"] if each["name"].startswith("simulated")]


def page_data(page: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(page.read_text().partition('id="data">')[2].partition("</script>")[0])
    return found


def test_the_ground_learns_how_fast_a_slow_drone_still_is_and_plans_for_it() -> None:
    slow = flight(Event(1.0, slow=inspector(), to=0.3))
    planned = next(each for each in slow.happened if "is limited to" in each.why)
    assert planned.why.startswith(f"{inspector()} is limited to 0.2")
    assert planned.begins is not None
    assert slow.outcome.satisfied
    assert slow.outcome.untouched


def test_a_world_that_changes_twice_has_both_changes_and_the_page_is_told_where_everybody_goes() -> None:
    own = flying()
    pieces = [read(own.flights[name]) for name in DRONES]
    told = UploadedTrajectories([each for each in pieces if isinstance(each, Pieces)], np.zeros(3))
    ground = GroundStation(own, told, DRONES, Seconds(3.0), LIMITS, 0)
    for place in ((6, 4.5), (6, 0.5)):
        ground.change(f"obstacle debris{place[1]:.0f} = disc at {place} radius 0.2")
    assert ground.world.mission is not None
    assert {"debris4", "debris0"} < {each.name for each in ground.world.mission.obstacles}
    assert all(text.count("debris") == 2 for text in ground.texts.values())
    still = Pieces(np.array([1.0]), np.zeros((1, 4, 8)))
    told.upload(0, still, 10.0)
    way = uploaded(told, own.trace).position
    assert np.allclose(way[:, :10], own.trace.position[:, :10], atol=0.01)
    assert np.allclose(way[0, 10:], 0.0)


def test_what_is_not_planned_in_time_is_asked_for_again_with_more_time() -> None:
    scenario = Scenario(events=(Event(2.0, lose=inspector()),))
    found = fly_loop(flying(), scenario, 0, Seconds(0.3), LIMITS, clock=Seconds(0.01))
    asked = [each for each in found.happened if each.begins is None and each.seconds]
    assert len(asked) > 1
    assert asked[1].why == "no plan in time"
    assert asked[1].time - asked[0].time == pytest.approx(0.3, abs=0.11)
    assert asked[2].time - asked[1].time == pytest.approx(0.6, abs=0.11)
    assert found.outcome.since["inspect"] > 2.0


HOP = """mission hop
time  step 1 s, horizon 4 s
world (0, 0) to (4, 4)
region there = box (2, 0.5) to (3.5, 1.5)
agent scout { dynamics single_integrator(speed <= 1 m/s)  start at (1, 1) }
require come: scout: eventually[0, end] there
"""


def test_a_flight_through_a_scenario_is_told_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "hop.mission").write_text(HOP)
    assert main(["compile", str(tmp_path / "hop.mission"), "-o", str(tmp_path / "hop"), "--quiet"]) == 0
    capsys.readouterr()
    (tmp_path / "s.toml").write_text('[[event]]\nat = 1\nchange = "region there = box (0.5, 3) to (1.5, 3.5)"\n')
    words = ["fly", str(tmp_path / "hop"), "--in", "simulation", "--scenario", str(tmp_path / "s.toml"), "--no-replan"]
    assert main([*words, "--format", "json", "--trace", str(tmp_path / "flown.csv")]) == 3
    document = json.loads(capsys.readouterr().out)
    assert document["flights"][0]["requirements"] == {"come": False}
    assert document["flights"][0]["happened"][0]["why"] == "the world changed"
    assert document["flights"][0]["nearest"] is None
    assert document["events"] == [{"t": 1.0, "change": "region there = box (0.5, 3) to (1.5, 3.5)"}]
    assert (tmp_path / "flown.csv").read_text().startswith("agent,t,x,y,z\n")
    page = tmp_path / "hop-flights.html"
    assert document["output"] == str(page)
    drawn = page_data(page)
    assert drawn["badge"]["state"] == "fails"
    assert [(each.get("from"), each.get("until")) for each in drawn["regions"]] == [(1.0, None), (0.0, 1.0)]
    (flown,) = drawn["loop"]["flights"]
    assert [each["by"] for each in flown["told"]] == ["event", "ground"]
    assert flown["lost"] == ["come"]
    page.write_text("not a page")
    assert main(words) == 1
    assert page.read_text() == "not a page"
    page.unlink()
    capsys.readouterr()
    (tmp_path / "s.toml").write_text('[[event]]\nat = 3\nchange = "require x: scout: there"\n')
    assert main(words) == 1
    assert "MC721" in capsys.readouterr().err
