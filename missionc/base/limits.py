"""Size limits of missions: each has a message with its name and a flag that raises it."""

from __future__ import annotations

from missionc.base.late_dataclass import Record

MOST = 10**15
"""Maximum value of a limit: whole numbers up to it are exact in floating point."""

DEEPEST = 256
"""Maximum depth of nesting and includes that every pass supports; some of them recurse."""


class Limits(Record):
    """Maximum sizes of a mission; each field is a ``--limit NAME=VALUE`` of the command line.

    Raises:
        ValueError: a limit is not positive, or above its own maximum.
    """

    file_bytes: int = 1 << 16
    """Bytes of a mission with its includes: 6 times one with 200 lines, so that a check takes at most two seconds."""
    nesting: int = DEEPEST
    name_length: int = 128
    digits: int = 15
    magnitude: float = 1e9
    steps: int = 100_000
    agents: int = 10_000
    include_depth: int = 32
    formula_nodes: int = 1_000_000
    family_parts: int = 30_000
    """Parts of the text after expansion of families and `for`: more than in any mission of maximum size."""
    shape_parts: int = 1_000
    formation_edges: int = 100_000
    clauses: int = 60_000_000
    trace_bytes: int = 1 << 28
    trace_samples: int = 2_000_000
    """Rows of a table, or agents times times of a list: each takes about half a kilobyte."""
    chunk_bytes: int = 1 << 26
    """Bytes of a record in a recording, and of an unpacked chunk: far more than recorders write."""
    recording_bytes: int = 1 << 34
    """Bytes of all unpacked chunks of a recording."""
    json_values: int = 30_000_000
    """Values of a JSON file: more numbers than fit into a trace."""
    checkpoint_bytes: int = 1 << 28
    map_bytes: int = 1 << 25
    """Total bytes of the files from which a mission's world and places are read."""
    map_cells: int = 1 << 24
    """Cells of an occupancy grid: 4096 by 4096."""
    map_features: int = 10_000
    """Shapes, points and rows of such a file."""
    map_corners: int = 100_000
    """Corners of all outlines in such a file, and of the borders between free and occupied cells."""
    map_lines: int = 1_000_000
    """Lines of text of a drawing: about ten seconds of reading."""
    simulated_seconds: int = 20_000
    """Seconds of all agents in all flights that are repeated to verify a simulation: a minute or two of work."""
    proof_steps: int = 1_000_000
    """Clauses of an infeasibility proof that are checked again: some minutes of work."""
    proof_literals: int = 20_000_000
    """Numbers in such a proof and in the clauses that it refutes."""

    def __post_init__(self) -> None:
        for name in type(self).__match_args__:
            if not 0 < getattr(self, name) <= most(name):
                raise ValueError(f"the limit `{name}` must be above 0 and at most {most(name):g}")


def most(name: str) -> int:
    """Maximum value of a limit."""
    return DEEPEST if name in ("nesting", "include_depth") else MOST
