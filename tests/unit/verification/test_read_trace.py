"""Reading a trace back, from a plan or a table."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.diagnostics.code import TRACE_MISMATCH, TRACE_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.output.documents.plan_json import plan_json
from missionc.output.documents.trajectories_csv import trajectories
from missionc.verification.monitoring.read_trace import read_trace
from tests.support.legal_plans import mission_of, planned, pushed, straight, wandering

MISSION = mission_of([[1.0, 1.0], [5.0, 5.0]], 2, step=0.1)
TABLE = """agent,t,x,y
drone[0],0,1,1
drone[0],0.1,1.1,1
drone[0],0.2,1.1,1.2
drone[1],0,5,5
drone[1],0.1,5,5
drone[1],0.2,5,4.9
"""


def good(text: str, mission: ir.Mission = MISSION) -> Trace:
    trace, findings = read_trace(Source("trace", text), mission)
    assert findings == []
    assert trace is not None
    return trace


def bad(text: str, mission: ir.Mission = MISSION) -> list[Diagnostic]:
    trace, findings = read_trace(Source("trace", text), mission)
    assert trace is None
    assert findings
    return findings


def line_of(finding: Diagnostic) -> int:
    assert finding.primary is not None
    return finding.primary.span.source.place(finding.primary.span.start)[0]


def same(one: Trace, other: Trace) -> None:
    for first, second in ((one.position, other.position), (one.velocity, other.velocity), (one.heading, other.heading)):
        assert np.array_equal(first, second)


def test_a_table_gives_positions_velocities_and_headings() -> None:
    trace = good(TABLE)
    assert trace.position[0].tolist() == [[1, 1], [1.1, 1], [1.1, 1.2]]
    assert trace.velocity[0] == pytest.approx(np.array([[1, 0], [0, 2], [0, 2]]))
    assert trace.heading[0] == pytest.approx([0, math.pi / 2, math.pi / 2])
    # It waits first, facing where it will go.
    assert trace.heading[1] == pytest.approx([-math.pi / 2] * 3)


def test_rows_in_any_order_and_other_columns_do_not_matter() -> None:
    header, *lines = TABLE.strip().splitlines()
    text = "\n".join([header + ",note", *(f"{line},who knows" for line in reversed(lines)), ""])
    same(good(text), good(TABLE))


def test_spaces_after_commas_do_not_matter_before_quotes_either() -> None:
    same(good(TABLE.replace(",", ", ").replace("1.1,", '"1.1",')), good(TABLE))
    same(good(TABLE.replace("\n", "\n\n  \n")), good(TABLE))


def test_a_written_plan_reads_back_the_same_to_the_last_bit() -> None:
    position = wandering(2, 3, 7)
    mission = mission_of(position[:, 0].tolist(), 7, step=0.1)
    trace = straight(position, 0.1)
    same(good(plan_json(mission, planned(mission, trace)), mission), trace)
    same(good(trajectories(mission, trace), mission), trace)


def test_a_written_plan_of_a_volume_reads_back_too() -> None:
    position = wandering(2, 2, 5, dimension=3)
    mission = mission_of(position[:, 0].tolist(), 5)
    same(good(plan_json(mission, planned(mission, straight(position))), mission), straight(position))
    same(good(trajectories(mission, straight(position)), mission), straight(position))


def test_a_finer_recording_is_read_at_the_steps() -> None:
    rows = [f"drone[0],{time / 100},{1 + time / 100},2" for time in range(201)]
    trace = good("agent,t,x,y\n" + "\n".join(rows), mission_of([[1.0, 2.0]], 2))
    assert trace.position[0] == pytest.approx(np.array([[1, 2], [2, 2], [3, 2]]))
    beside = [f"drone[0],{time},{1 + time},2" for time in (0, 0.7, 1.4, 2)]
    assert good("agent,t,x,y\n" + "\n".join(beside), mission_of([[1.0, 2.0]], 2)).position[0] == pytest.approx(
        np.array([[1, 2], [2, 2], [3, 2]])
    )


def test_double_integrators_without_velocities_get_those_between_their_motions() -> None:
    push = np.array([[[1.0, 0.0], [1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]]])
    trace = pushed(np.array([[1.0, 5.0]]), np.zeros((1, 2)), push, 1.0)
    mission = mission_of([[1.0, 5.0]], 4, dynamics=ir.DoubleIntegrator(5.0, 2.0))
    rows = [f"drone[0],{step},{x},{y}" for step, (x, y) in enumerate(trace.position[0])]
    found = good("agent,t,x,y\n" + "\n".join(rows), mission)
    assert found.velocity[0, 1] == pytest.approx([1.0, 0.0])
    assert found.velocity[0, 2] == pytest.approx([1.75, 0.0])


def changed(line: int, text: str) -> str:
    lines = TABLE.splitlines()
    lines[line - 1] = text
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("text", "code", "line", "words"),
    [
        ("", TRACE_UNREADABLE, 1, "missing column `agent`"),
        (changed(1, "agent,t,x"), TRACE_UNREADABLE, 1, "missing column `y`"),
        (changed(3, "drone[0],0.1,1.1"), TRACE_UNREADABLE, 3, "3 values"),
        (changed(3, "drone[0],0.1,abc,1"), TRACE_UNREADABLE, 3, "`abc`"),
        (changed(3, "drone[0],0.1,nan,1"), TRACE_UNREADABLE, 3, "`nan`"),
        (changed(3, "drone[0],0.1,1e400,1"), TRACE_UNREADABLE, 3, "`1e400`"),
        (changed(3, "drone[7],0.1,1,1"), TRACE_MISMATCH, 3, "`drone[7]`"),
        (changed(3, "drone[0],0.1,1.1,1\ndrone[0],0.1,1.2,1"), TRACE_MISMATCH, 4, "two positions at 0.1 s"),
        (changed(4, ""), TRACE_MISMATCH, 3, "last sample at 0.1 s"),
        (changed(2, ""), TRACE_MISMATCH, 3, "first sample at 0.1 s"),
        (changed(3, ""), TRACE_MISMATCH, 4, "from 0 s to 0.2 s"),
        ("agent,t,x,y\n", TRACE_MISMATCH, 1, "`drone[0]`"),
        (changed(3, "drone[0],0.1,1e200,1"), TRACE_UNREADABLE, 3, "`x` of `drone[0]` is 1e+200 at 0.1 s"),
        (changed(3, "drone[0],0.1,1,-2e9"), TRACE_UNREADABLE, 3, "the limit is 1e+09"),
        ('{"times": [], "times": [], "agents": []}', TRACE_UNREADABLE, 1, "is duplicated"),
        ('{"times": [], "agents": ["\\ud800"]}', TRACE_UNREADABLE, 1, "unpaired surrogate"),
        ("{", TRACE_UNREADABLE, 1, "not JSON"),
        ("[]", TRACE_UNREADABLE, 1, "`times` and `agents`"),
        ("[" * 100_000, TRACE_UNREADABLE, 1, ""),
        ('{"times": [' + "9" * 5000 + '], "agents": []}', TRACE_UNREADABLE, 1, ""),
        ('{"times": [], "agents": [{}]}', TRACE_UNREADABLE, 1, "no name"),
    ],
)
def test_a_trace_that_does_not_fit_is_refused_at_its_line(text: str, code: object, line: int, words: str) -> None:
    finding = bad(text)[0]
    assert finding.code is code
    assert line_of(finding) == line
    assert words in finding.message


def document() -> dict[str, object]:
    loaded = json.loads(plan_json(MISSION, planned(MISSION, good(TABLE))))
    assert isinstance(loaded, dict)
    return loaded


@pytest.mark.parametrize(
    ("key", "value", "code"),
    [
        ("name", "stranger", TRACE_MISMATCH),
        ("position", None, TRACE_UNREADABLE),
        ("position", [[1, 1]], TRACE_UNREADABLE),
        ("position", [[1, 1], [1, True], [1, 1]], TRACE_UNREADABLE),
        ("position", [[1, 1], ["a", 1], [1, 1]], TRACE_UNREADABLE),
        ("position", [[1], [1], [1]], TRACE_MISMATCH),
        ("velocity", [[1, 1], [1, 1], [1, float("inf")]], TRACE_UNREADABLE),
        ("velocity", 7, TRACE_UNREADABLE),
        ("yaw", [0, 0], TRACE_UNREADABLE),
        ("yaw", [0, 1e160, 0], TRACE_UNREADABLE),
        ("velocity", [[1, 1], [1, 1], [1, 1e308]], TRACE_UNREADABLE),
    ],
)
def test_a_plan_with_a_strange_entry_is_refused_at_the_agents_name(key: str, value: object, code: object) -> None:
    plan = document()
    plan["agents"][0][key] = value  # type: ignore[index]
    text = json.dumps(plan, indent=1)
    finding = bad(text)[0]
    assert finding.code is code
    assert finding.primary is not None
    if key != "name":
        assert finding.primary.span.text == '"drone[0]"'


def test_a_column_that_is_not_read_may_hold_any_number() -> None:
    header, *lines = TABLE.strip().splitlines()
    same(good("\n".join([header + ",stamp", *(f"{line},1.7e18" for line in lines)])), good(TABLE))


def test_larger_numbers_are_read_where_the_limit_allows_them() -> None:
    text = TABLE.replace("drone[0],0.1,1.1,1", "drone[0],0.1,2e9,1")
    assert read_trace(Source("trace", text), MISSION, Limits(magnitude=1e10))[1] == []


def test_a_plan_without_velocities_is_read() -> None:
    plan = document()
    for agent in plan["agents"]:  # type: ignore[attr-defined]
        del agent["velocity"], agent["yaw"]
    trace = good(json.dumps(plan))
    assert trace.velocity == pytest.approx(good(TABLE).velocity)


def test_a_plan_of_another_time_is_refused() -> None:
    plan = document()
    plan["times"] = [0.0, 0.05, 0.1]
    findings = bad(json.dumps(plan))
    assert {finding.code for finding in findings} == {TRACE_MISMATCH}
    assert len(findings) == 2
    assert "the mission lasts 0.2 s" in findings[0].message


def test_everything_that_is_wrong_is_said_up_to_a_bound() -> None:
    lines = ["agent,t,x,y", *(f"drone[0],{step},a,b" for step in range(500))]
    findings = bad("\n".join(lines))
    assert [line_of(finding) for finding in findings] == list(range(2, 22))


@settings(max_examples=100)
@given(st.data())
def test_no_text_makes_the_reader_stumble(data: st.DataObject) -> None:
    text = TABLE if data.draw(st.booleans()) else plan_json(MISSION, planned(MISSION, good(TABLE)))
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 30)))
    text = text[:start] + data.draw(st.text(max_size=8)) + text[end:]
    trace, findings = read_trace(Source("trace", text), MISSION)
    assert (trace is None) == bool(findings)
    if trace is not None:
        assert trace.position.shape == (2, 3, 2)
        assert np.isfinite(trace.position).all()


def test_the_module_reads_no_file(tmp_path: Path) -> None:
    source = Source(str(tmp_path / "is not there"), TABLE)
    assert read_trace(source, MISSION)[1] == []


WHOLE = "add positions at least every 0.1 s, from 0 s to 0.2 s"
AS_PLAN = "write `times` and `agents`, each with `name` and `position`, as in `plan.json`"


def plan(**agent: object) -> str:
    own = {"name": "drone[0]", "position": [[1, 1], [1, 1], [1, 1]]} | agent
    return json.dumps({"times": [0, 0.1, 0.2], "agents": [own]})


@pytest.mark.parametrize(
    ("text", "message", "help"),
    [
        ("", "missing column `agent`, `t`, `x`, `y` in the first line", "begin the file with the header `agent,t,x,y`"),
        (changed(3, "drone[0],0.1,1.1"), "the row has 3 values, but the first line has 4 columns", ""),
        (changed(3, "drone[0],0.1," + "a" * 41 + ",1"), f"`{'a' * 40}` is not a finite number", ""),
        (changed(3, "drone[0],0.1,1_0,1"), "`1_0` is not a finite number", ""),
        (changed(3, "drone[0],0.1,١,1"), "`١` is not a finite number", ""),
        (changed(3, "drone[7],0.1,1,1"), "the mission has no agent `drone[7]`", ""),
        (
            changed(3, "drone[0],0.1,1.1,1\ndrone[0],0.1,1.2,1"),
            "`drone[0]` has two positions at 0.1 s",
            WHOLE,
        ),
        (changed(4, ""), "`drone[0]` has its last sample at 0.1 s; the mission lasts 0.2 s", WHOLE),
        (changed(2, ""), "`drone[0]` has its first sample at 0.1 s; the mission begins at 0 s", WHOLE),
        (changed(3, ""), "`drone[0]` has no samples from 0 s to 0.2 s, longer than a step", WHOLE),
        ("agent,t,x,y\n", "no samples of `drone[0]`", WHOLE),
        (
            changed(3, "drone[0],0.1,1e200,1"),
            "`x` of `drone[0]` is 1e+200 at 0.1 s; the limit is 1e+09",
            "write positions in metres from a nearby origin",
        ),
        (
            changed(3, "drone[0],-2e9,1,1"),
            "`t` of `drone[0]` is -2e+09 at -2e+09 s; the limit is 1e+09",
            None,
        ),
        ("[]", "the lists `times` and `agents` are missing", AS_PLAN),
        ('{"times": {}, "agents": []}', "the lists `times` and `agents` are missing", AS_PLAN),
        ('{"times": [], "agents": [{}]}', "an agent has no name", AS_PLAN),
        ('{"times": [], "agents": [7]}', "an agent has no name", AS_PLAN),
        (plan(position=None), "`drone[0]` has no list `position`", AS_PLAN),
        (plan(velocity=7), "`drone[0]` has no list `velocity`", AS_PLAN),
        (plan(yaw=[0.0]), "`drone[0]` has 1 entries in `yaw`for 3 times", AS_PLAN),
        (
            plan(position=[[1, 1], [1, "x"], [1, 1]]),
            "`drone[0]` has an entry in `position` without 3 finite numbers",
            AS_PLAN,
        ),
        (
            plan(position=[[1, 1], 7, [1, 1]]),
            "`drone[0]` has an entry in `position` without 3 finite numbers",
            AS_PLAN,
        ),
        (
            plan(velocity=[[1, 1], [1, True], [1, 1]]),
            "`drone[0]` has an entry in `velocity` without 3 finite numbers",
            AS_PLAN,
        ),
        (plan(yaw=[0, None, 0]), "`drone[0]` has an entry in `yaw` without 1 finite numbers", AS_PLAN),
        (
            plan(position=[[1, 1], [1], [1, 1]]),
            "`drone[0]` has a position without x and y; the world has 2 coordinates",
            "",
        ),
        (
            json.dumps({"times": [0, None], "agents": [{"name": "drone[0]", "position": [[1, 1], [1, 1]]}]}),
            "a time is not a finite number",
            AS_PLAN,
        ),
    ],
)
def test_what_is_wrong_is_said_with_a_way_out(text: str, message: str, help: str | None) -> None:
    first = bad(text)[0]
    assert first.message == message
    if help is not None:
        assert first.help == help


def test_a_mission_that_asks_for_headings_has_to_be_told_them() -> None:
    asked = ir.Holds(ir.Facing(0.0, 1.0), MISSION.span)
    mission = replace(
        MISSION, requirements=(ir.Requirement("faces", ir.OfAgent(1, asked, MISSION.span), MISSION.span),)
    )
    (found,) = bad(TABLE, mission)
    assert found.message == "missing `yaw` of `drone[1]`: the mission uses its heading"
    assert found.help == "add `yaw` at each time, in rad"
    assert line_of(found) == 5
    lines = TABLE.strip().splitlines()
    turned = "\n".join([lines[0] + ",yaw", *(f"{line},{number / 4}" for number, line in enumerate(lines[1:]))])
    assert good(turned, mission).heading.tolist() == [[0.0, 0.25, 0.5], [0.75, 1.0, 1.25]]


def test_a_heading_is_kept_until_the_next_one_and_positions_are_between_two() -> None:
    rows = ["agent,t,x,y,yaw", "drone[0],0,1,1,1", "drone[0],0.75,4,1,2", "drone[0],1.25,4,3,3", "drone[0],2,4,3,4"]
    mission = mission_of([[1.0, 1.0]], 2)
    trace = good("\n".join(rows), mission)
    assert trace.heading.tolist() == [[1.0, 2.0, 4.0]]
    assert trace.position[0] == pytest.approx(np.array([[1, 1], [4, 2], [4, 3]]))


def test_a_heading_is_that_of_the_motion_and_before_any_that_of_the_first() -> None:
    rows = [(1, 1), (1, 1), (1, 2), (1, 2), (0, 2), (0, 2)]
    text = "agent,t,x,y\n" + "\n".join(f"drone[0],{time},{x},{y}" for time, (x, y) in enumerate(rows))
    trace = good(text, mission_of([[1.0, 1.0]], 5))
    up, left = math.pi / 2, math.pi
    assert trace.heading[0] == pytest.approx([up, up, up, left, left, left])
    still = "agent,t,x,y\n" + "\n".join(f"drone[0],{time},1,1" for time in range(3))
    assert good(still, mission_of([[1.0, 1.0]], 2)).heading.tolist() == [[0.0] * 3]
