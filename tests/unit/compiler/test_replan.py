"""A mission that is being flown is planned anew: what was flown, and the new plan, satisfy it together."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from missionc.base.diagnostics.code import (
    NO_LONGER_KEPT,
    NO_SAFE_STOP,
    NOT_BY_THEN,
    NOT_TO_BE_CHANGED,
    PAST_DOES_NOT_FIT,
)
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds, Steps
from missionc.cli.app import main
from missionc.compiler.remaining import remaining
from missionc.compiler.replan.patch import patched
from missionc.compiler.replan.replan import replan
from missionc.compiler.replan.request import Replanned, Request, Way
from missionc.compiler.results import Verified
from missionc.flight.trajectories.stop_and_hover import state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.planning.progression.past_document import Past, past_json, read_past
from missionc.tools.replay.render_report import render_report
from missionc.tools.replay.reverify import reverify
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.monitoring.read_trace import FlownSoFar, read_flown
from tests.support import forged_folders
from tests.support.forged_folders import Table
from tests.support.shelf_flight import compiled, flown, flying, folder, inspector, replanned, written_to

LIMITS = Limits()
SOON, PATIENT = Seconds(3.0), Seconds(60.0)


def so_far(until: int, *lost: str) -> FlownSoFar:
    mission = flying().checked.mission
    assert mission is not None
    found, findings = read_flown(Source("flown.csv", flown(until)), mission, lost)
    assert found is not None, findings
    return found


def changed(text: str) -> dict[str, str]:
    edited = patched(compiled().checked, Source("patch", text), LIMITS)
    assert not isinstance(edited, list), edited
    return dict(edited)


def without_the_inspector(until: int = 4) -> Replanned:
    lost = (inspector(),)
    return replan(flying(), Request(so_far(until, *lost), lost, in_time=SOON, clock=PATIENT), LIMITS)


def joint(found: Replanned) -> Trace:
    """What was flown and told, and the plan after it, of whoever is left."""
    assert found.rest is not None
    assert found.rest.past is not None
    assert found.compiled is not None
    assert isinstance(found.compiled.outcome, Verified)
    plan = found.compiled.outcome.plan.trace
    left = found.rest.past.flown[-1].agents
    pieces = []
    for each in found.rest.past.flown:
        rows, trace = [each.agents.index(name) for name in left], each.stretch.trace
        pieces.append([column[rows, :-1] for column in (trace.position, trace.velocity, trace.heading)])
    pieces.append([plan.position, plan.velocity, plan.heading])
    return Trace(plan.step, *(np.concatenate(column, axis=1) for column in zip(*pieces, strict=True)))


def test_a_plan_that_still_holds_is_kept() -> None:
    other = next(f"drone[{index}]" for index in range(3) if f"drone[{index}]" != inspector())
    found = replan(flying(), Request(so_far(4, other), (other,)), LIMITS)
    assert found.way is Way.KEPT
    assert found.certificate is not None
    assert found.certificate.passed
    assert not found.files


def test_who_is_left_finishes_the_mission(tmp_path: Path) -> None:
    found = without_the_inspector()
    assert found.way is Way.REPAIRED, found.findings
    assert found.rest is not None
    assert found.rest.past is not None
    # Nobody counts on the lost one after the step that follows the one at which it was seen last.
    before, after = found.rest.past.flown
    assert (before.stretch.steps, before.stretch.lost) == (5, (inspector(),))
    assert inspector() not in after.agents
    trace = joint(found)
    # Judged once more by the mission as it was written, of a team that always was so small.
    mission, kernel = compiled().checked.mission, compiled().checked.kernel
    assert mission is not None
    assert kernel is not None
    lone = [agent.name for agent in mission.agents].index(inspector())
    assert trace.position.shape[1] == mission.steps + 1
    three = Trace(
        trace.step,
        *(np.insert(each, lone, each[0], axis=0) for each in (trace.position, trace.velocity, trace.heading)),
    )
    assert all(each.satisfied for each in monitor(mission, kernel, three).requirements)
    verified = reverify(written_to(tmp_path, found.files))
    assert verified.passed, verified.findings
    assert verified.certificate is not None
    assert found.begins is not None
    past = json.loads(render_report(verified).decode().partition('id="data">')[2].partition("</script>")[0])["past"]
    assert (past["begins"], past["lost"]) == (found.begins, [inspector()])
    assert [(each["phase"], each["begin"], each["end"]) for each in past["phases"]] == [
        ("flown", 0.0, 4.0),
        ("told", 4.0, found.begins),
        ("plan", found.begins, 22.0),
    ]
    assert [(each["agent"], each["flown"], len(each["places"])) for each in past["ways"]] == [
        *((agent.name, 5, 6) for agent in mission.agents),
        *((name, 1, int(found.begins) - 5 + 1) for name in after.agents),
    ]
    assert {"stop", "stop separation", "stop obstacle"} <= {check.name for check in verified.certificate.checks}
    (tmp_path / "past.json").write_text((tmp_path / "past.json").read_text().replace(inspector(), "drone[9]", 1))
    assert not reverify(tmp_path).passed


def test_stops_begin_as_the_plan_goes_on_and_end_at_rest_where_the_new_one_begins() -> None:
    found = without_the_inspector()
    assert found.begins is not None
    assert isinstance(found.compiled and found.compiled.outcome, Verified)
    old, files = flying().flights, dict(found.files)
    for name, text in found.stops.items():
        stop, before = read(text), read(old[name])
        assert isinstance(stop, Pieces)
        assert isinstance(before, Pieces)
        # From position to snap nothing jumps where the stop takes over.
        assert np.allclose(state_at(stop, 0.0)[:, :3], state_at(before, 4.0)[:, :3], atol=1e-4)
        after = read(files[f"crazyflie/{name.replace('[', '').replace(']', '')}.csv"].decode())
        assert isinstance(after, Pieces)
        end, begin = state_at(stop, 100.0), state_at(after, 0.0)
        assert np.allclose(end[0, :3], begin[0, :3], atol=1e-4)
        assert np.allclose(end[1:4, :3], 0.0, atol=1e-3)
        assert stop.duration.sum() == pytest.approx(found.begins - 4.0, abs=1e-4)


def test_a_world_that_changes_is_another_one_from_then_on(tmp_path: Path) -> None:
    written_to(tmp_path, replanned().items())
    assert "obstacle debris" in (tmp_path / "mission/shelf.mission").read_text()
    past = read_past((tmp_path / "past.json").read_text(), 1e9)
    assert isinstance(past, Past)
    assert "debris" not in past.flown[0].texts["shelf.mission"]
    assert reverify(tmp_path).passed


def test_what_is_impossible_is_said_and_what_else_can_be_done() -> None:
    request = Request(so_far(4, inspector()), (inspector(),), in_time=Seconds(15.0), clock=PATIENT)
    found = replan(flying(), request, LIMITS)
    assert found.way is Way.NONE
    assert found.cannot == ("inspect",)
    assert found.findings[-1].code is NOT_BY_THEN
    rest = replan(flying(), replace(request, given_up=("inspect",), in_time=SOON), LIMITS)
    assert rest.ok


def test_an_obstacle_where_somebody_is_leaves_no_stop() -> None:
    other = next(index for index in range(3) if f"drone[{index}]" != inspector())
    x, y = so_far(4).last[other].tolist()
    found = replan(
        flying(), Request(so_far(4), texts=changed(f"obstacle debris = disc at ({x}, {y}) radius 0.3")), LIMITS
    )
    assert [each.code for each in found.findings] == [NO_SAFE_STOP]
    assert found.must_stop


def test_who_is_off_the_way_begins_anew_where_it_is_and_the_whole_is_judged_too(tmp_path: Path) -> None:
    other = next(index for index in range(3) if f"drone[{index}]" != inspector())
    seen = so_far(4)
    position, last = seen.trace.position.copy(), seen.last.copy()
    position[other, -1] += (0.4, 0.0)
    last[other] += (0.4, 0.0)
    away = replace(seen, trace=replace(seen.trace, position=position), last=last)
    found = replan(flying(), Request(away, in_time=SOON, clock=PATIENT), LIMITS)
    assert found.ok, found.findings
    assert found.rest is not None
    assert found.rest.mission is not None
    start = found.rest.mission.agents[other].start
    assert start.point is not None
    assert start.point == pytest.approx(tuple(last[other]), abs=1e-3)
    verified = reverify(written_to(tmp_path, found.files))
    assert verified.passed, verified.findings
    assert verified.certificate is not None
    whole = [check.subject for check in verified.certificate.checks if check.name == "whole requirement"]
    assert whole == ["inspect", "home"]


def test_holes_in_a_log_are_gone_straight_over_and_long_ones_are_not() -> None:
    mission = flying().checked.mission
    assert mission is not None
    fine = ["agent,t,x,y"]
    for name in ("drone[0]", "drone[1]", "drone[2]"):
        fine += [f"{name},{time},{time},1" for time in (0.4, 1.2, 1.2, 1.9, 2.9)]
    found, findings = read_flown(Source("flown.csv", "\n".join(fine)), mission, ())
    assert found is not None, findings
    assert found.until == 2.9
    assert found.trace.position[0, :, 0].tolist() == pytest.approx([0.4, 1.0, 2.0])
    _, findings = read_flown(Source("flown.csv", "\n".join(fine).replace(",1.9,1.9,1", ",1.3,1.3,1")), mission, ())
    assert "has no samples from 1.3 s to 2.9 s" in findings[0].message


def test_who_is_lost_stays_where_it_was_seen_last_and_the_others_end_where_the_first_of_them_does() -> None:
    mission = flying().checked.mission
    assert mission is not None
    text = "agent,t,x,y,yaw\n"
    for name, end in (("drone[0]", 4), ("drone[1]", 5), ("drone[2]", 2)):
        text += "".join(f"{name},{time},{time},1,{time}\n" for time in range(end + 1))
    found, findings = read_flown(Source("flown.csv", text), mission, ("drone[2]",))
    assert found is not None, findings
    assert (found.until, found.seen.tolist()) == (4.0, [4.0, 4.0, 2.0])
    assert found.last.tolist() == [[4.0, 1.0], [4.0, 1.0], [2.0, 1.0]]
    assert found.trace.position[:, :, 0].tolist() == [[0, 1, 2, 3, 4], [0, 1, 2, 3, 4], [0, 1, 2, 2, 2]]
    gone, findings = read_flown(Source("flown.csv", text), mission, ())
    assert gone is not None, findings
    assert (gone.until, gone.trace.position.shape[1]) == (2.0, 3)


def test_a_hole_of_several_steps_is_filled_on_the_straight_line() -> None:
    mission = flying().checked.mission
    assert mission is not None
    fine = replace(mission, step=Seconds(0.25), steps=Steps(4 * mission.steps))
    rows = [(0.0, 0.0, 0.0), (0.25, 1.0, 0.5), (1.0, 4.0, 2.0), (1.25, 4.0, 2.5)]
    text = "agent,t,x,y,yaw\n" + "".join(
        f"{agent.name},{time},{x},1,{yaw}\n" for agent in mission.agents for time, x, yaw in rows
    )
    found, findings = read_flown(Source("flown.csv", text), fine, ())
    assert found is not None, findings
    assert found.trace.position[0, :, 0].tolist() == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0, 4.0])
    assert found.trace.heading[0].tolist() == pytest.approx([0.0, 0.5, 0.5, 0.5, 2.0, 2.5])


def test_of_a_mission_that_is_over_nothing_is_left() -> None:
    mission = flying().checked.mission
    assert mission is not None
    text = "agent,t,x,y\n"
    for agent in mission.agents:
        text += "".join(f"{agent.name},{step},{step / 10},1\n" for step in range(mission.steps + 1))
    found, findings = read_flown(Source("flown.csv", text), mission, ())
    assert found is None
    assert "the mission ended at" in findings[0].message


def test_nothing_is_planned_for_nobody() -> None:
    found = replan(flying(), Request(so_far(4), ("drone[0]", "drone[1]", "drone[2]")), LIMITS)
    assert [each.code for each in found.findings] == [NO_LONGER_KEPT]


def test_a_patch_changes_the_world_and_nothing_that_is_asked() -> None:
    wrong = """time step 2 s, horizon 3 s
team drone[4] { vehicle crazyflie21 }
agent scout { start at (1, 1) }
graph radio = proximity 3 m
require x: some drone: pad
"""
    included = patched(compiled().checked, Source("patch", 'include "site.mission"\n'), LIMITS)
    assert isinstance(included, list)
    assert [each.code for each in included] == [NOT_TO_BE_CHANGED]
    found = patched(compiled().checked, Source("patch", wrong), LIMITS)
    assert isinstance(found, list)
    assert {each.code for each in found} == {NOT_TO_BE_CHANGED}
    assert len(found) == 5


def test_a_patch_takes_the_place_of_what_it_names() -> None:
    text = changed(
        """obstacle rack = disc at (3.2, 2) radius 0.5
region look = box (4.5, 1) to (6, 4)
team drone[3] { dynamics single_integrator(speed <= 0.5 m/s) }
"""
    )["shelf.mission"]
    assert "obstacle rack = disc at (3.2, 2) radius 0.5\n" in text
    assert "box (4.8, 1)" not in text
    assert "speed <= 0.5 m/s" in text
    assert "start    at (1, 1), (1, 2.5), (1, 4)" in text


def test_a_past_reads_back_as_it_was_written_and_no_other_text_does() -> None:
    found = without_the_inspector()
    assert found.rest is not None
    assert found.rest.past is not None
    text = past_json(found.rest.past)
    again = read_past(text, 1e9)
    assert isinstance(again, Past)
    assert past_json(again) == text
    document = json.loads(text)
    for change in (
        {"schema": "missionc.past/0"},
        {"stretches": []},
        {"stretches": [{**document["stretches"][0], "step": "1"}]},
        {"stretches": [{**document["stretches"][0], "agents": []}]},
        {"stretches": [{**document["stretches"][0], "more": 1}]},
        {"stretches": [{**document["stretches"][0], "agents": [{"name": "a", "position": [[1e12, 0]]}]}]},
    ):
        assert isinstance(read_past(json.dumps({**document, **change}), 1e9), str)
    past = replace(again, flown=(replace(again.flown[0], agents=("a", "b", "c")),))
    refused = remaining(compiled().checked, past, LIMITS)
    assert isinstance(refused, Diagnostic)
    assert refused.code is PAST_DOES_NOT_FIT


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--lost", "drone[7]"), "MC721"),
        (("--give-up", "nothing"), "MC721"),
    ],
)
def test_the_command_line_names_who_is_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], says: str
) -> None:
    place = folder(tmp_path / "shelf")
    (tmp_path / "flown.csv").write_text(flown(3))
    assert main(["replan", str(place), "--flown", str(tmp_path / "flown.csv"), *arguments]) == 1
    assert says in capsys.readouterr().err


def test_the_command_line_keeps_a_plan_that_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = folder(tmp_path / "shelf")
    (tmp_path / "flown.csv").write_text(flown(3))
    words = ["replan", str(place), "--flown", str(tmp_path / "flown.csv")]
    assert main(words) == 0
    assert "the current plan remains valid" in capsys.readouterr().out
    assert not (tmp_path / "shelf-replan").exists()
    assert main([*words, "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["outcome"] == "kept"
    (tmp_path / "flown.csv").write_text(flown(22))
    assert main(words) == 1
    assert "MC705" in capsys.readouterr().err


def far_away(table: Table) -> Table:
    table[:-1, 1:] = 0.0
    table[:-1, 1] = 1000.0
    return table


def bent(table: Table) -> Table:
    table[0, 1 + 8 + 4] += 0.01
    return table


def shortened(table: Table) -> Table:
    """Without its first piece: it begins later, somewhere else on its path."""
    return table[1:]


@pytest.mark.parametrize("forge", [far_away, bent, shortened])
def test_a_folder_with_another_stop_is_refused(forge: Callable[[Table], Table], tmp_path: Path) -> None:
    files = replanned()
    assert reverify(forged_folders.forged(tmp_path / "written", files)).passed
    for name in (each for each in files if each.startswith("stop/")):
        files = forged_folders.changed(files, name, forge)
    certificate = reverify(forged_folders.forged(tmp_path / "forged", files)).certificate
    assert certificate is not None
    assert any(check.name in ("stop joints", "stop begins") for check in certificate.failures)


@pytest.mark.parametrize("name", ["past.json", "stop/drone0.csv"])
def test_a_document_in_another_spelling_is_refused(name: str, tmp_path: Path) -> None:
    spelt = {"past.json": (b"{", b'{"more": 1,'), "stop/drone0.csv": (b",0,", b",0.0,")}[name]
    files = {**replanned(), name: replanned()[name].replace(*spelt, 1)}
    certificate = reverify(forged_folders.forged(tmp_path, files)).certificate
    assert certificate is not None
    assert {check.subject for check in certificate.failures} == {name}
