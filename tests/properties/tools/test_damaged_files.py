"""A file that a command reads, changed by chance in one place: it is read or refused in words, and nothing raises."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from missionc.backends.api import Snapshot
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.base.trace import Judgement, Trace
from missionc.base.units import Seconds
from missionc.compiler.checkpoint_file import from_bytes, to_bytes
from missionc.flight.simulation.judge_flight import Error, Flight
from missionc.ir.kernel.nodes import Kernel
from missionc.output.documents.safe_end_json import read_safe_end
from missionc.planning.progression.past_document import Flown, Past, past_json, read_past
from missionc.planning.progression.stretches import Stretch
from missionc.tools.closed_loop.scenario import read_scenario
from missionc.tools.sweep import flights_journal
from missionc.tools.sweep.flights_journal import FlightsJournal
from missionc.tools.sweep.results_table import Table, groups
from missionc.tools.sweep.run_answer import RunResult
from missionc.tools.sweep.run_grid import Run
from missionc.tools.sweep.sweep_folder import JOURNAL, SWEEP, Row, SweepFolder, begin, read_sweep
from missionc.verification.certificate import Check
from missionc.verification.monitoring.live.mcap_poses import FOXGLOVE, McapPoses
from missionc.verification.monitoring.live.samples import SampleReader, UnusableError
from missionc.verification.monitoring.read_trace import read_flown
from tests.support.legal_plans import mission_of
from tests.support.mutated_folders import mutated_file

EACH = 40
MISSION = mission_of([(1.0, 1.0), (4.0, 1.0)], 4)
NAMES = tuple(agent.name for agent in MISSION.agents)
STATES = Trace(Seconds(1.0), np.ones((2, 3, 2)), np.zeros((2, 3, 2)), np.zeros((2, 3)))
FLOWN = Flight(
    (Error(0.1, 0.2, 0.3, 1.0), Error(0.1, 0.2, 0.3, 1.0)),
    np.zeros(0),
    STATES,
    (Judgement("reach", True, float("inf")), Judgement("stay", False, -1.0, 2, (NAMES[0],))),
    (),
    (Check("room", "all pairs", 1.0, "m", 0.0, True, 1.0, NAMES),),
)
IDENTITY = {"folder": "f00", "seed": "3"}
RUN = Run((("N", "1"),), 0)
ABOUT = {"mission": "made", "varied": {"N": ["1", "3"]}, "seeds": 2, "options": {"margin": "0"}}


def sweep(name: str) -> Callable[[bytes, Path], object]:
    """One of the files of a sweep's folder, among the others as they were written."""

    def read(content: bytes, folder: Path) -> object:
        (folder / SWEEP).write_bytes(documents()["sweep.json"][0])
        (folder / JOURNAL).write_bytes(documents()["runs.jsonl"][0])
        (folder / name).write_bytes(content)
        found = read_sweep(folder)
        if isinstance(found, SweepFolder):
            rows = {run: row for run, row in found.rows.items() if run == RUN}  # of others the command takes none
            Table(("N",), rows.values()).csv()
            groups([RUN.values], rows)
        return found, begin(folder, ABOUT, {})

    return read


def journal(content: bytes, folder: Path) -> object:
    (folder / "flights").write_bytes(content)
    with flights_journal.opened(folder / "flights") as opened:
        assert isinstance(opened, FlightsJournal)
        return opened.begin(IDENTITY, FLOWN)


def samples(content: bytes, _: Path) -> object:
    try:
        return SampleReader(MISSION, Kernel((), ())).read(content.decode("utf-8", "replace"))
    except UnusableError as error:
        return str(error)


def poses(content: bytes, _: Path) -> object:
    recording = McapPoses({}, 2)
    first = recording._line("drone[0]", FOXGLOVE, "json", documents()["pose.json"][0])
    return first, recording._line("drone[0]", FOXGLOVE, "json", content)


@cache
def documents() -> Mapping[str, tuple[bytes, Callable[[bytes, Path], object]]]:
    """Each file as it is written, and its reader."""
    begins = {name: np.zeros((5, 4)) for name in NAMES}
    past = past_json(Past((Flown(Stretch(STATES, (), (), {NAMES[0]: 0.5}, begins), NAMES, 1.0, {"a": "b"}, begins),)))
    row = Row(RUN, RunResult("planned", {"seconds": 1.5, "says": ""}, {"nodes": 3}))
    lines = flights_journal._first(IDENTITY) + b'\n{"first":1,"flights":%s}\n' % flights_journal.flights_text(
        [FLOWN], False
    )
    pose = {
        "timestamp": {"sec": 5, "nsec": 7},
        "pose": {"position": dict.fromkeys("xyz", 1.0), "orientation": dict.fromkeys("xyzw", 0.5)},
    }
    plan = {"times": [0.0, 1.0], "agents": [{"name": name, "positions": [[1.0, 1.0]] * 2} for name in NAMES]}
    sample = {"t": 0.5, "agent": "drone[0]", "position": [1.0, 2.0], "velocity": [0.0, 0.0], "heading": 0.1}
    stops = {"at": 0.0, "seconds": 1.0, "land": [[NAMES[0]]], "hover": [NAMES[1]], "stops": [[0.0] * 32] * 2}
    ends = {"schema": "missionc.safe_end/1", "mission": "made", "agents": list(NAMES), "moments": [stops]}
    events = '[[event]]\nat = 8.0\nslow = "drone[1]"\nto = 0.5\n[[event]]\nat = 9\nlose = "drone[0]"\n'
    storm = f"[wind]\nmean = 0.5\n{events}"
    return {
        "sweep.json": (json.dumps({"schema": "missionc.sweep/1", **ABOUT}).encode(), sweep(SWEEP)),
        "runs.jsonl": (row.as_line() + b"\n", sweep(JOURNAL)),
        "flights.jsonl": (lines, journal),
        "past.json": (past.encode(), lambda content, _: read_past(content.decode("utf-8", "replace"), 1e9)),
        "safe_end.json": (
            json.dumps(ends).encode(),
            lambda content, _: read_safe_end(content.decode("utf-8", "replace"), MISSION),
        ),
        "sample.json": (json.dumps(sample).encode(), samples),
        "pose.json": (json.dumps(pose).encode(), poses),
        "plan.json": (
            json.dumps(plan).encode(),
            lambda content, _: read_flown(Source("plan.json", content.decode("utf-8", "replace")), MISSION, ()),
        ),
        "storm.toml": (
            storm.encode(),
            lambda content, _: read_scenario(Source("storm.toml", content.decode("utf-8", "replace")), NAMES),
        ),
        "search.checkpoint": (
            to_bytes(Snapshot({"a": np.arange(3.0)}, {"search": "{}"}), IDENTITY),
            lambda content, _: from_bytes(content, "search.checkpoint", IDENTITY),
        ),
    }


@pytest.mark.parametrize("name", documents())
def test_a_file_changed_by_chance_is_read_or_refused_in_words(name: str, tmp_path: Path) -> None:
    whole, read = documents()[name]
    for seed in range(EACH):
        content, what = mutated_file(name, whole, seed)
        try:
            found = read(content, tmp_path)
        except Exception as error:
            raise AssertionError(f"seed {seed}, {what}: {content[:300]!r}") from error
        for said in found if isinstance(found, tuple | list) else (found,):
            assert not isinstance(said, Diagnostic) or said.code.name != "MC901", what
