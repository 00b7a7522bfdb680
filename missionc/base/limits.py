"""Size limits of missions: each has a message that names it and a flag that raises it."""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass

MOST = 10**15
"""The largest value of a limit: a whole number that arithmetic in floating point still holds exactly."""

DEEPEST = 256
"""Levels of nesting, and of includes, that every pass holds; some of them recurse."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The sizes a mission may have; each field is a ``--limit NAME=VALUE`` of the command line.

    Raises:
        ValueError: one is not above 0, or above what it may be raised to.
    """

    file_bytes: int = 1 << 16
    """Bytes of a mission with all it includes: 6 times one of 200 lines, so few that any is checked in two seconds."""
    nesting: int = DEEPEST
    name_length: int = 128
    digits: int = 15
    magnitude: float = 1e9
    steps: int = 100_000
    agents: int = 10_000
    include_depth: int = 32
    formula_nodes: int = 1_000_000
    family_parts: int = 30_000
    """Parts of the text that families and `for` are spelt out to: more than any mission of the largest size has."""
    shape_parts: int = 1_000
    formation_edges: int = 100_000
    clauses: int = 60_000_000
    trace_bytes: int = 1 << 28
    trace_samples: int = 2_000_000
    """Rows of a table, and agents times times of a list: each takes about half a kilobyte."""
    chunk_bytes: int = 1 << 26
    """Bytes of a record in a recording, and of a chunk unpacked: far more than recorders put together."""
    recording_bytes: int = 1 << 34
    """Bytes of all chunks of a recording, unpacked."""
    json_values: int = 30_000_000
    """Values of a file in JSON: more numbers than fit into a trace."""
    checkpoint_bytes: int = 1 << 28
    map_bytes: int = 1 << 25
    """Bytes of all files together that a mission's world and places are read from."""
    map_cells: int = 1 << 24
    """Cells of an occupancy grid: 4096 by 4096."""
    map_features: int = 10_000
    """Shapes, points and rows of such a file."""
    map_corners: int = 100_000
    """Corners of all outlines in such a file, and of the borders between free and occupied cells."""
    map_lines: int = 1_000_000
    """Lines of text of a drawing: some ten seconds of reading."""
    simulated_seconds: int = 20_000
    """Seconds of all agents in all flights together, flown once more to judge a simulation: a minute or two of work."""
    proof_steps: int = 1_000_000
    """Clauses of a proof that there is no plan, gone through once more to judge it: some minutes of work."""
    proof_literals: int = 20_000_000
    """Numbers in such a proof and in the clauses that it refutes."""

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not 0 < getattr(self, name) <= most(name):
                raise ValueError(f"the limit `{name}` must be above 0 and at most {most(name):g}")


def most(name: str) -> int:
    """The largest value that a limit may be given."""
    return DEEPEST if name in ("nesting", "include_depth") else MOST
