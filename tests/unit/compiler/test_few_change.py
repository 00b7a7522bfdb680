"""Few change their plan where it has to be another one: the others fly on, in motion while the new one begins."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.replan_summary import replanned_document, replanned_lines
from missionc.compiler.driver import compile
from missionc.compiler.replan.patch import patched
from missionc.compiler.replan.replan import replan
from missionc.compiler.replan.request import Flying, Replanned, Request, Way
from missionc.compiler.results import Verified
from missionc.flight.trajectories.stop_and_hover import state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, polynomials, read
from missionc.output.folder.file_names import flights_in
from missionc.planning.progression.past_document import Past, past_json, read_past
from missionc.tools.replay.reverify import reverify
from missionc.verification.monitoring.read_trace import read_flown
from tests.support.shelf_flight import written_to

LANES = """mission lanes
time  step 1 s, horizon 20 s
world (0, 0) to (12, 6)
region far = box (10, 0.3) to (11.7, 5.7)
team drone[3] {
  vehicle  crazyflie21
  dynamics single_integrator(speed <= 1 m/s)
  start    at (1, 1), (1, 3), (1, 5)
}
separation 0.2 m
require across: every drone: eventually[0, end] far
"""
LIMITS, AT = Limits(), 4


@cache
def flying() -> Flying:
    compiled = compile(Source("lanes.mission", LANES), backend="smt")
    assert isinstance(compiled.outcome, Verified), compiled.findings
    assert compiled.checked.mission is not None
    flights = flights_in(compiled.checked.mission.agents, dict(compiled.outcome.files))
    return Flying(compiled.checked, compiled.outcome.plan.trace, flights)


@cache
def found() -> Replanned:
    """An obstacle has come into the middle lane, well ahead."""
    own = flying()
    mission = own.checked.mission
    assert mission is not None
    rows = [
        f"{agent.name},{step},{','.join(map(str, own.trace.position[agent.index, step].tolist()))}"
        for agent in mission.agents
        for step in range(AT + 1)
    ]
    so_far, findings = read_flown(Source("flown.csv", "\n".join(["agent,t,x,y", *rows]) + "\n"), mission, ())
    assert so_far is not None, findings
    x, y = own.trace.position[1, AT + 6].tolist()
    texts = patched(own.checked, Source("patch", f"obstacle debris = disc at ({x:.2f}, {y:.2f}) radius 0.3"), LIMITS)
    assert not isinstance(texts, list), texts
    return replan(own, Request(so_far, texts=dict(texts), in_time=Seconds(1.0), clock=Seconds(60.0)), LIMITS)


def plan_of(replanned: Replanned) -> Verified:
    assert replanned.compiled is not None
    assert isinstance(replanned.compiled.outcome, Verified), replanned.findings
    return replanned.compiled.outcome


def test_one_flies_around_what_appeared_and_the_others_keep_to_their_plan() -> None:
    assert (found().way, found().changed) == (Way.REPAIRED, ("drone[1]",))
    old, new = flying().trace.position, plan_of(found()).plan.trace.position
    assert found().begins == AT + 1
    assert np.allclose(new[[0, 2]], old[[0, 2], AT + 1 :], atol=1e-9)
    assert np.abs(new[1] - old[1, AT + 1 :]).max() > 0.2


def test_the_summary_names_who_flies_another_way() -> None:
    assert "  from 5 s on, drone[1] follows a new path; no agent stops" in replanned_lines(found(), "")
    document = replanned_document(found(), None)
    assert (document["changed"], document["in_motion"]) == (["drone[1]"], ["drone[0]", "drone[1]", "drone[2]"])


def test_nothing_jumps_where_the_new_plan_begins_in_motion(tmp_path: Path) -> None:
    files = dict(found().files)
    for name, text in found().stops.items():
        told, before = polynomials(text), polynomials(flying().flights[name])
        after = read(files[f"crazyflie/{name.replace('[', '').replace(']', '')}.csv"].decode())
        assert isinstance(after, Pieces)
        end, begin = state_at(told, 100.0), state_at(after, 0.0)
        assert np.linalg.norm(end[1, :2]) > 0.2  # nobody stops
        assert np.allclose(state_at(told, 0.0), state_at(before, AT), atol=1e-4)
        assert np.allclose(end, begin, atol=1e-3)
    verified = reverify(written_to(tmp_path, found().files))
    assert verified.passed, verified.findings
    assert verified.certificate is not None
    assert {"begins", "rest", "stop"} <= {check.name for check in verified.certificate.checks}


@pytest.mark.parametrize("order", range(5))
def test_a_state_that_is_not_the_flights_is_no_beginning(tmp_path: Path, order: int) -> None:
    folder = written_to(tmp_path, found().files)
    document = json.loads((folder / "past.json").read_text())
    document["stretches"][-1]["moving"]["drone[0]"][order][0] += 0.05 * 3**order
    (folder / "past.json").write_text(json.dumps(document))
    assert not reverify(folder).passed


def test_a_past_without_such_states_is_none() -> None:
    rest = found().rest
    assert rest is not None
    assert rest.past is not None
    text = past_json(rest.past)
    again = read_past(text, 1e9)
    assert isinstance(again, Past)
    assert past_json(again) == text
    document = json.loads(text)
    stretch = document["stretches"][-1]
    for moving in ([], {"drone[0]": [[0.0] * 4] * 4}, {"drone[0]": [["a"] * 4] * 5}, {"drone[9]": [[0.0] * 4] * 5}):
        broken = {**document, "stretches": [{**stretch, "moving": moving}]}
        assert isinstance(read_past(json.dumps(broken), 1e9), str)


def test_the_rest_begins_in_motion_and_leaves_everybody_free() -> None:
    rest = found().rest
    assert rest is not None
    assert rest.mission is not None
    assert all(len(agent.begins) == 5 and agent.course == () for agent in rest.mission.agents)
