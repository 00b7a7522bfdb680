"""Reader and writer of a Crazyflie's trajectory CSV, with its numbers as the firmware will hold them.

The uav_trajectories format: a header, then one row for each piece: its
duration, and eight coefficients each of x, y, z and yaw in ascending powers of
the seconds since the piece began.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Curves

COLUMNS = ("duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8)))


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """One file: (pieces,) seconds and (pieces, 4, 8) coefficients of x, y, z, yaw; float32 values."""

    duration: Array
    coefficients: Array

    @property
    def times(self) -> Array:
        """(pieces + 1,), seconds: the joints."""
        return np.concatenate([[0.0], np.cumsum(self.duration)])


def curves_of(files: Sequence[Pieces], rows: slice) -> Curves:
    """The joint motion that files with the same durations hold; ``rows`` are those wanted of x, y, z and yaw."""
    return Curves(files[0].times, np.stack([own.coefficients[:, rows] for own in files]))


def read(text: str) -> Pieces | str:
    """The pieces of a file as the firmware will hold them, or what is wrong with it."""
    lines = text.split("\n")
    if lines[0] != ",".join(COLUMNS):
        return "the first line is not the header"
    if lines[-1] != "" or len(lines) < 4:
        return "it has less than two whole rows"
    rows = []
    for number, line in enumerate(lines[1:-1], start=2):
        try:
            row = [float(word) for word in line.split(",")]
        except ValueError:
            return f"line {number} holds something else than numbers"
        if len(row) != len(COLUMNS):
            return f"line {number} has {len(row)} columns, not {len(COLUMNS)}"
        rows.append(row)
    with np.errstate(over="ignore"):
        numbers = np.array(rows).astype(np.float32).astype(np.float64)
    if not np.isfinite(numbers).all() or (numbers[:, 0] <= 0).any():
        return "a number is not finite, or a duration not positive"
    return Pieces(numbers[:, 0], numbers[:, 1:].reshape(-1, 4, 8))


def polynomials(text: str) -> Pieces:
    """The pieces of a file that was verified.

    Raises:
        ValueError: what is wrong with a text that holds none.
    """
    pieces = read(text)
    if isinstance(pieces, str):
        raise ValueError(pieces)
    return pieces


def written(pieces: Pieces) -> str:
    """The text of a file; nine significant digits tell every float32 number from every other."""
    table = np.concatenate([pieces.duration[:, None], pieces.coefficients.reshape(len(pieces.duration), -1)], axis=1)
    # Adding zero turns -0 into 0.
    rows = (",".join(f"{number + 0.0:.9g}" for number in row) for row in table.tolist())
    return "\n".join((",".join(COLUMNS), *rows)) + "\n"
