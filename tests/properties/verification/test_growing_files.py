"""Files that grow: each is counted first, and refused with a code, the count and the flag that raises the limit."""

from __future__ import annotations

import json
import re
import struct
import tracemalloc
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import lz4.frame
import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.compiler.driver import check
from missionc.ir import Mission
from missionc.verification.impossibility.check_refutation import CNF, DRAT, check_drat
from missionc.verification.monitoring.live.mcap_poses import CHUNK, MAGIC, BrokenRecordingError, McapPoses
from missionc.verification.monitoring.read_trace import read_trace
from tests.support.mapped_missions import HEAD, findings

LIMIT = 60
"""Of whatever a file is counted in."""


def mapped(limits: Limits, name: str, content: str | bytes, words: str = "") -> list[str]:
    with TemporaryDirectory() as folder:
        found = findings(Path(folder), f'obstacles from "{name}" {words}\n', {name: content}, limits)
    return [said(finding) for finding in found]


def said(finding: Diagnostic) -> str:
    return f"{finding.code.name} {finding.message} {finding.help}"


@cache
def mission() -> Mission:
    meant = check(Source("m", HEAD)).mission
    assert meant is not None
    return meant


def traced(limits: Limits, text: str) -> list[str]:
    return [said(finding) for finding in read_trace(Source("flight", text), mission(), limits)[1]]


def grid(size: int, limits: Limits) -> list[str]:
    """A checkerboard of 2 rows: two cells with four corners each for each of ``size`` times 2 columns."""
    cells = np.indices((2, 2 * size)).sum(axis=0) % 2 * 255
    stream = BytesIO()
    Image.fromarray(cells.astype(np.uint8)).save(stream, "PNG")
    return mapped(limits, "m.png", stream.getvalue(), "resolution 5 cm")


def holes(size: int, limits: Limits) -> list[str]:
    """An area with a row of square holes: rings of five positions."""

    def ring(x: float, side: float) -> list[list[float]]:
        return [[x, 1], [x + side, 1], [x + side, 1 + side], [x, 1 + side], [x, 1]]

    rings = [ring(0, size + 2), *(ring(1 + at, 0.5) for at in range(1, size))]
    rings = [[[x / 100, y / 100] for x, y in each] for each in rings]
    rings[0] = [[x, y - 0.01] for x, y in rings[0]]
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": rings}}
    text = json.dumps({"type": "FeatureCollection", "features": [feature]})
    return mapped(limits, "m.geojson", text, "unit 1 m")


def values(size: int, limits: Limits) -> list[str]:
    return mapped(limits, "m.geojson", "[" + ",".join(["[]"] * size) + "]", "unit 1 m")


def rows(size: int, limits: Limits) -> list[str]:
    return mapped(limits, "m.csv", "x,y,radius\n" + "9,9,0.1\n" * size)


def blank_rows(size: int, limits: Limits) -> list[str]:
    return mapped(limits, "m.csv", "x,y,radius\n" + "\r" * (size - 1) + "9,9,0.1")


def trace_rows(size: int, limits: Limits) -> list[str]:
    return traced(limits, "agent,t,x,y\n" + "scout,0,1,1\n" * size)


def trace_times(size: int, limits: Limits) -> list[str]:
    agents = [{"name": "scout", "position": [[1, 1]] * size}]
    return traced(limits, json.dumps({"times": list(range(size)), "agents": agents}))


def trace_agents(size: int, limits: Limits) -> list[str]:
    agents = [{"name": f"a{at}", "position": []} for at in range(size)]
    return traced(limits, json.dumps({"times": [], "agents": agents}))


def proof_steps(size: int, limits: Limits) -> list[str]:
    """All steps in one line."""
    return [check_drat({CNF: b"p cnf 2 1\n1 2 0\n", DRAT: b"1 2 0 " * size}, limits).detail]


def proof_literals(size: int, limits: Limits) -> list[str]:
    """One step, and each number followed by one character that ends it."""
    return [check_drat({CNF: b"", DRAT: b"1 " * (size - 1) + b"0\n"}, limits).detail]


def chunk(unpacked: int, claimed: int, compression: bytes = b"") -> bytes:
    content = b"\x7f" + struct.pack("<Q", unpacked - 9) + bytes(unpacked - 9)
    pack = {b"": bytes, b"lz4": lz4.frame.compress, b"zstd": zstandard.compress}[compression]
    packed = pack(content)
    head = struct.pack("<QQQII", 0, 0, claimed, 0, len(compression)) + compression
    record = head + struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", CHUNK, len(record)) + record


def recorded(content: bytes, limits: Limits) -> list[str]:
    try:
        list(McapPoses({}, 2, limits).feed(MAGIC + content))
    except BrokenRecordingError as error:
        return [str(error)]
    return []


def chunk_bytes(size: int, limits: Limits) -> list[str]:
    return recorded(chunk(size, size, b"lz4"), limits)


def recording_bytes(size: int, limits: Limits) -> list[str]:
    return recorded(chunk(30, 30) + chunk(10 + size, 10 + size), limits)


GROWING: list[tuple[str, Callable[[int, Limits], list[str]], Callable[[int], int]]] = [
    ("map_corners", grid, lambda size: 8 * size),
    ("map_corners", holes, lambda size: 5 * size),
    ("json_values", values, lambda size: 2 * size + 1),
    ("map_features", rows, lambda size: size),
    ("map_features", blank_rows, lambda size: size),
    ("trace_samples", trace_rows, lambda size: size),
    ("trace_samples", trace_times, lambda size: size),
    ("trace_samples", trace_agents, lambda size: size),
    ("proof_steps", proof_steps, lambda size: size),
    ("proof_literals", proof_literals, lambda size: size),
    ("recording_bytes", recording_bytes, lambda size: 40 + size),
]


@pytest.mark.parametrize(("name", "grow", "count"), GROWING, ids=[grow.__name__ for _, grow, _ in GROWING])
@given(size=st.integers(2, 2 * LIMIT))
@settings(max_examples=6)
def test_a_file_is_refused_just_when_its_count_is_above_the_limit(
    name: str, grow: Callable[[int, Limits], list[str]], count: Callable[[int], int], size: int
) -> None:
    refused = [each for each in grow(size, Limits(**{name: LIMIT})) if f"--limit {name}={count(size)}" in each]
    assert bool(refused) == (count(size) > LIMIT)
    assert all(re.search(rf"\b{count(size)}\b.*--limit", each) for each in refused)


@pytest.mark.parametrize("compression", [b"lz4", b"zstd"])
@pytest.mark.parametrize("claimed", [1_000, 40_000_000])
def test_a_chunk_is_unpacked_no_further_than_it_claims_and_may(compression: bytes, claimed: int) -> None:
    content = chunk(40_000_000, claimed, compression)
    assert len(content) < 400_000
    tracemalloc.start()
    found = recorded(content, Limits(chunk_bytes=1_000_000))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "chunk" in found[0]
    assert peak < 5_000_000


@pytest.mark.parametrize("grow", [values, blank_rows, rows, trace_rows, proof_steps], ids=lambda each: each.__name__)
def test_what_is_refused_was_not_taken_apart(grow: Callable[[int, Limits], list[str]]) -> None:
    """Memory is a few times the text alone: no row, value or step was made of it."""
    size = 50_000
    limits = Limits(json_values=10_000, map_features=10_000, trace_samples=10_000, proof_steps=10_000)
    grow(2, limits)
    tracemalloc.start()
    found = grow(size, limits)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "--limit" in found[0]
    assert peak < 10_000_000
