"""Lines of samples: what each of them says, and what is said of those that cannot be used."""

from __future__ import annotations

import json
import math

import pytest

from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.verification.monitoring.live.first_violations import first_violations
from missionc.verification.monitoring.live.samples import SampleReader, UnusableError
from tests.support.random_runs import trace_of

TEXT = """mission watched
time step 1 s, horizon 4 s
world (0, 0) to (6, 6)
region goal = box (4, 4) to (5.5, 5.5)
team drone[3] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start at (5, 5), (1, 1), (3, 1) }
require there: drone[0]: always[1 s, 3 s] goal
require slow:  drone[1]: always[0, 4 s] speed <= 1
require turns: drone[2]: eventually[0, 4 s] heading within 30 deg of 0 deg
"""


def reader() -> SampleReader:
    checked = check(Source("watched.mission", TEXT))
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None, checked.findings
    return SampleReader(checked.mission, checked.kernel)


def test_a_line_says_where_an_agent_is_how_fast_and_where_it_faces() -> None:
    (whole,) = reader().read(
        json.dumps({"t": 1.5, "agent": "drone[2]", "position": [1, 2], "velocity": [0.5, 0], "heading": 0.25})
    )
    assert (whole.agent, whole.time, whole.position, whole.velocity) == (2, 1.5, (1.0, 2.0), (0.5, 0.0))
    assert whole.heading == 0.25
    (furthest,) = reader().read(json.dumps({"t": 0, "agent": "drone[0]", "position": [1e9, -1e9]}))
    assert furthest.position == (1e9, -1e9)
    (bare,) = reader().read(json.dumps({"t": 1, "agent": "drone[0]", "position": [1, 2]}))
    assert (bare.agent, bare.velocity) == (0, ())
    assert math.isnan(bare.heading)


def test_a_mission_in_the_plane_leaves_a_third_coordinate_out() -> None:
    flat = reader()
    flat.read(json.dumps({"t": 0, "agent": "drone[0]", "position": [1, 2]}))
    assert not flat.flattened
    line = {"t": 0, "agent": "drone[1]", "position": [1, 2, 0.5], "velocity": [0.5, 0, 0.1]}
    (sample,) = flat.read(json.dumps(line))
    assert (sample.position, sample.velocity, flat.flattened) == ((1.0, 2.0), (0.5, 0.0), True)
    for strange in ([1, 2, "up"], [1, 2, 3, 4]):
        with pytest.raises(UnusableError):
            flat.read(json.dumps({"t": 0, "agent": "drone[0]", "position": strange}))


@pytest.mark.parametrize(
    ("record", "said"),
    [
        ([], "not a JSON object"),
        ({"agent": "drone[0]"}, "`t` is not a finite number"),
        ({"t": True}, "`t` is not a finite number"),
        ({"t": 0, "agents": []}, "`agents` is not a record of positions by agent name"),
        ({"t": 0, "agent": 1}, "`agent` is not the name of an agent"),
        ({"t": 0, "agent": "scout"}, "the mission has no agent `scout`"),
        ({"t": 0, "agent": "drone[0]", "position": [1]}, "`position` of `drone[0]` is not a list of 2 numbers"),
        ({"t": 0, "agents": {"drone[0]": [1, "x"]}}, "`position` of `drone[0]` is not a finite number"),
        (
            {"t": 0, "agent": "drone[0]", "position": [1, 1], "velocity": 1},
            "`velocity` of `drone[0]` is not a list of 2 numbers",
        ),
        (
            {"t": 0, "agent": "drone[0]", "position": [1, 1], "velocity": [1, None]},
            "`velocity` of `drone[0]` is not a finite number",
        ),
        (
            {"t": 0, "agent": "drone[0]", "position": [1, 1], "heading": "x"},
            "`heading` of `drone[0]` is not a finite number",
        ),
        (
            {"t": 0, "agent": "drone[1]", "position": [1, 1]},
            "missing `velocity` of `drone[1]`: the mission uses its speed",
        ),
        (
            {"t": 0, "agent": "drone[2]", "position": [1, 1], "velocity": [0, 0]},
            "missing `heading` of `drone[2]`: the mission uses its heading",
        ),
        ({"t": 1e300, "agent": "drone[0]"}, "`t` is 1e+300; the limit is"),
    ],
    ids=lambda each: each[:40] if isinstance(each, str) else "",
)
def test_a_line_that_cannot_be_used_is_said_why(record: object, said: str) -> None:
    with pytest.raises(UnusableError) as found:
        reader().read(json.dumps(record))
    assert str(found.value).startswith(said)


def test_the_first_step_at_which_nothing_helps_any_more_is_said_of_each_requirement() -> None:
    checked = check(Source("watched.mission", TEXT))
    assert checked.mission is not None
    assert checked.kernel is not None
    ways = [[(5, 5), (3.5, 5), (3, 5), (5, 5), (5, 5)], [(1, 1), (1, 1), (1, 1), (3, 1), (5, 1)], [(3, 1)] * 5]
    trace = trace_of([[(float(x), float(y)) for x, y in way] for way in ways])
    assert first_violations(checked.mission, checked.kernel, trace) == {"there": 1, "slow": 2}
    still = trace_of([[(5.0, 5.0)] * 5, [(1.0, 1.0)] * 5, [(3.0, 1.0)] * 5])
    assert first_violations(checked.mission, checked.kernel, still) == {}
