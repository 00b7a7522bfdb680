"""The table of a sweep: a row for each run in the grid's order, as CSV and as Parquet.

Of what is in a row, ``OF_THE_MACHINE`` follows from that; everything else is the
same wherever, and beside however many others, a run was done, where it was not
cut short.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from importlib.util import find_spec

from missionc.diagnostics.code import EXTRA_MISSING
from missionc.diagnostics.model import Diagnostic
from missionc.sweep.run_result import Value
from missionc.sweep.sweep_folder import Row
from missionc.sweep.varied_values import number_of

CSV, PARQUET = "runs.csv", "runs.parquet"

COLUMNS: dict[str, type] = {
    "seed": int,
    "outcome": str,
    "scope": str,
    "engine": str,
    "cut_short": str,
    "agents": int,
    "steps": int,
    "seconds": float,
    "flown_in": float,
    "cpu_seconds": float,
    "peak_bytes": int,
    "length": float,
    "duration": float,
    "robustness": float,
    "tightest": str,
    "margin": float,
    "flights": int,
    "flights_kept": int,
    "tracking_error": float,
    "plan": str,
    "codes": str,
    "says": str,
    "host": str,
}
"""Those of every table, after the parameters and before the sizes, and what is in them where anything is."""
OF_THE_MACHINE = ("seconds", "flown_in", "cpu_seconds", "peak_bytes", "host", "size_solver_bytes")


class Table:
    """Columns by name, of one type each, and rows of values."""

    def __init__(self, names: Sequence[str], rows: Iterable[Row]) -> None:
        found = list(rows)
        units = {name: _unit([dict(row.run.values)[name] for row in found]) for name in names}
        sizes = sorted({size for row in found for size in row.result.sizes})
        self.parameters = {name: _column(name, unit) for name, unit in units.items()}
        self.types: dict[str, type] = {
            "run": str,
            **{self.parameters[name]: str if units[name] is None else float for name in names},
            **COLUMNS,
            **{_size_column(size): int for size in sizes},
        }
        self.rows = [self._cells(row, names) for row in found]

    def _cells(self, row: Row, names: Sequence[str]) -> dict[str, Value]:
        values = dict(row.run.values)
        cells: dict[str, Value] = {
            "run": row.run.name,
            **{self.parameters[name]: _number(values[name], self.types[self.parameters[name]]) for name in names},
            "seed": row.run.seed,
            "outcome": row.result.outcome,
            "host": row.host or None,
            **row.result.values,
            **{_size_column(size): count for size, count in row.result.sizes.items()},
        }
        return {name: _of_type(cells.get(name), kind) for name, kind in self.types.items()}

    def csv(self) -> bytes:
        """In UTF-8, with a head; nothing stands where there is no value."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.types)
        writer.writerows(["" if cell is None else cell for cell in row.values()] for row in self.rows)
        return text.getvalue().encode("utf-8", "replace")

    def parquet(self) -> bytes:
        """With a type for each column; pyarrow is there."""
        import pyarrow
        from pyarrow import parquet

        kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
        schema = pyarrow.schema([(name, kinds[kind]) for name, kind in self.types.items()])
        sink = io.BytesIO()
        parquet.write_table(pyarrow.Table.from_pylist(self.rows, schema=schema), sink)
        return sink.getvalue()


def missing() -> Diagnostic | None:
    """What to say where no Parquet can be written; absent where it can."""
    if find_spec("pyarrow"):
        return None
    message = "a table in Parquet needs the package pyarrow, which is not installed"
    return Diagnostic(EXTRA_MISSING, message, None, help="install it with `pip install 'missionc[sweep]'`")


def _size_column(size: str) -> str:
    return f"size_{size.replace(' ', '_')}"


def _column(name: str, unit: str | None) -> str:
    """The column of a parameter: its name, and the unit of its values where they are numbers with one."""
    return f"{name} [{unit}]" if unit else f"param_{name}" if name in COLUMNS or name == "run" else name


def _unit(values: list[str]) -> str | None:
    """The unit that all of these numbers have, empty for none; None where they are no numbers of one unit."""
    units = {None if number is None else number[1] for number in map(number_of, values)}
    return units.pop() if len(units) == 1 else None


def _number(text: str, kind: type) -> Value:
    number = number_of(text)
    return text if kind is str or number is None else number[0]


def _of_type(value: Value, kind: type) -> Value:
    """The value as one of the column's type; nothing where it is none."""
    if value is None or kind is str:
        return None if value is None else str(value)
    try:
        return int(value) if kind is int else float(value)
    except ValueError:
        return None
