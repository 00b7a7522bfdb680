"""Size limits of missions; the message about an exceeded limit names the limit and the option that raises it."""

from __future__ import annotations

from missionc.base.late_dataclass import Record

MOST = 10**15
"""Maximum value of a limit: integers up to it are exact in floating point."""

DEEPEST = 256
"""Maximum depth of nesting and of includes, bounded because some passes recurse."""


class Limits(Record):
    """Maximum sizes of a mission and its files; each field is an option ``--limit NAME=VALUE``.

    Raises:
        ValueError: a limit is not positive, or exceeds the maximum value of a limit.
    """

    file_bytes: int = 1 << 16
    """Bytes of a mission with its includes: 6 times a mission of 200 lines; a check takes at most two seconds."""
    nesting: int = DEEPEST
    name_length: int = 128
    digits: int = 15
    magnitude: float = 1e9
    steps: int = 100_000
    agents: int = 10_000
    include_depth: int = 32
    formula_nodes: int = 1_000_000
    family_parts: int = 30_000
    """Parts of the text after expansion of families and `for`: more than any mission within the other limits needs."""
    shape_parts: int = 1_000
    formation_edges: int = 100_000
    clauses: int = 60_000_000
    trace_bytes: int = 1 << 28
    trace_samples: int = 2_000_000
    """Samples of a trace file: table rows, or agents times sample times; half a kilobyte of memory each."""
    chunk_bytes: int = 1 << 26
    """Bytes of a record in a recording (MCAP), and of an unpacked chunk: far more than recorders write."""
    recording_bytes: int = 1 << 34
    """Bytes of all unpacked chunks of a recording (MCAP)."""
    json_values: int = 30_000_000
    """Values of a JSON file: more than the largest allowed trace contains."""
    checkpoint_bytes: int = 1 << 28
    map_bytes: int = 1 << 25
    """Total bytes of the map files from which a mission reads its world and its positions."""
    map_cells: int = 1 << 24
    """Cells of an occupancy grid: 4096 by 4096."""
    map_features: int = 10_000
    """Shapes, points and rows of a map file."""
    map_corners: int = 100_000
    """Corners of all outlines in a map file, and of the boundaries between free and occupied cells of a grid."""
    map_lines: int = 1_000_000
    """Lines of text of a map drawing: about ten seconds of reading."""
    simulated_seconds: int = 20_000
    """Simulated seconds of all agents and flights, repeated to verify a simulation: one or two minutes of work."""
    proof_steps: int = 1_000_000
    """Clauses of an infeasibility proof that are verified again: some minutes of work."""
    proof_literals: int = 20_000_000
    """Literals in an infeasibility proof and in the clauses that it refutes."""

    def __post_init__(self) -> None:
        for name in type(self).__match_args__:
            if not 0 < getattr(self, name) <= most(name):
                raise ValueError(f"the limit `{name}` must be above 0 and at most {most(name):g}")


def most(name: str) -> int:
    """Maximum value that a user may set for the named limit."""
    return DEEPEST if name in ("nesting", "include_depth") else MOST
