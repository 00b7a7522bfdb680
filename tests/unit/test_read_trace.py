"""Reading a trace back, from a plan or a table."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.diagnostics.code import TRACE_MISMATCH, TRACE_UNREADABLE
from missionc.diagnostics.model import Diagnostic
from missionc.monitoring.read_trace import read_trace
from missionc.output.documents.plan_json import plan_json
from missionc.output.documents.trajectories_csv import trajectories
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
        ("", TRACE_UNREADABLE, 1, "no column `agent`"),
        (changed(1, "agent,t,x"), TRACE_UNREADABLE, 1, "no column `y`"),
        (changed(3, "drone[0],0.1,1.1"), TRACE_UNREADABLE, 3, "3 values"),
        (changed(3, "drone[0],0.1,abc,1"), TRACE_UNREADABLE, 3, "`abc`"),
        (changed(3, "drone[0],0.1,nan,1"), TRACE_UNREADABLE, 3, "`nan`"),
        (changed(3, "drone[0],0.1,1e400,1"), TRACE_UNREADABLE, 3, "`1e400`"),
        (changed(3, "drone[7],0.1,1,1"), TRACE_MISMATCH, 3, "`drone[7]`"),
        (changed(3, "drone[0],0.1,1.1,1\ndrone[0],0.1,1.2,1"), TRACE_MISMATCH, 4, "two places at 0.1 s"),
        (changed(4, ""), TRACE_MISMATCH, 3, "last seen at 0.1 s"),
        (changed(2, ""), TRACE_MISMATCH, 3, "first seen at 0.1 s"),
        (changed(3, ""), TRACE_MISMATCH, 4, "from 0 s to 0.2 s"),
        ("agent,t,x,y\n", TRACE_MISMATCH, 1, "`drone[0]`"),
        (changed(3, "drone[0],0.1,1e200,1"), TRACE_UNREADABLE, 3, "`x` of `drone[0]` is 1e+200 at 0.1 s"),
        (changed(3, "drone[0],0.1,1,-2e9"), TRACE_UNREADABLE, 3, "the largest number may be 1e+09"),
        ('{"times": [], "times": [], "agents": []}', TRACE_UNREADABLE, 1, "comes twice"),
        ('{"times": [], "agents": ["\\ud800"]}', TRACE_UNREADABLE, 1, "half of a surrogate pair"),
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
