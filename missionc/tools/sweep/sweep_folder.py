"""Folder of a parameter sweep: its definition, a journal of finished runs, and a lock.

    says MC701 MC702 MC761 MC762 MC763

``sweep.json`` defines the sweep and is written first. The journal ``runs.jsonl`` has a line for each finished run; all
other files are derived from it, and replaced atomically.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missionc.base.diagnostics.code import OTHER_SWEEP, SWEEP_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.strict_json import NotJsonError, parse_record
from missionc.frontend.syntax.read_file import Absent, read_bytes
from missionc.output.folder.ownership import cannot_write, exists, reason, shown
from missionc.output.folder.staging import NAME, sweep
from missionc.output.folder.write_folder import write_inside
from missionc.tools.sweep import run_answer
from missionc.tools.sweep.append_journal import LARGEST, Journal, locked
from missionc.tools.sweep.run_answer import ERROR, OUTCOMES, RunResult
from missionc.tools.sweep.run_grid import Run

SWEEP, SCHEMA = "sweep.json", "missionc.sweep/1"
JOURNAL = "runs.jsonl"
AGAIN = "start the sweep in another folder"
PLANS = "plans"
"""Subfolder of the plans' folders, each named after its run."""
MISSION = "mission"
"""Subfolder of the mission's own files."""
SHOWN = 3
"""Maximum number of differences that a message states."""


@dataclass(frozen=True, slots=True)
class Row:
    """Finished run with its result, and the machine that did it."""

    run: Run
    result: RunResult
    host: str = ""

    def as_record(self) -> dict[str, object]:
        return {
            "values": dict(self.run.values),
            "seed": self.run.seed,
            "outcome": self.result.outcome,
            "host": self.host,
            **{name: value for name, value in self.result.values.items() if value is not None},
            "sizes": dict(self.result.sizes),
        }

    def as_line(self) -> bytes:
        """Line of the run in the journal."""
        return run_answer.one_line(self.as_record()).encode("ascii")


@dataclass(frozen=True, slots=True)
class SweepFolder:
    """Sweep read from its folder.

    Args:
        path: path of the folder.
        about: definition of the sweep.
        rows: finished runs; of several rows for one run, the last.
    """

    path: Path
    about: Mapping[str, Any]
    rows: Mapping[Run, Row]


def read_sweep(path: Path) -> SweepFolder | Diagnostic:
    """Read the folder of a sweep without changing it, or return the reason why it is unreadable."""
    about = _about(path)
    if isinstance(about, Diagnostic):
        return about
    rows = _rows(path)
    return rows if isinstance(rows, Diagnostic) else SweepFolder(path, about, rows)


def begin(path: Path, about: Mapping[str, object], files: Mapping[str, bytes]) -> Diagnostic | None:
    """Create the folder of a sweep, or check that an existing one belongs to it; return the error, or None.

    Args:
        path: path of the folder.
        about: definition of the sweep; its ``varied`` and ``seeds`` may only grow.
        files: the mission's files, by relative name.
    """
    document = json.loads(json.dumps({"schema": SCHEMA, **about}))  # as it reads back
    try:
        names = os.listdir(path) if os.path.lexists(path) else []
        there = sorted(name for name in names if not NAME.fullmatch(name))  # not the remains of a killed process
    except OSError as error:
        return cannot_write(path, reason(error))
    if there and SWEEP not in there:
        return exists(path, " and contains no sweep", [f"there is `{shown(name)}` in it" for name in there])
    for home in {path, path / PLANS, *((path / MISSION / name).parent for name in files)}:
        sweep(home)
    if there:
        before = _about(path)
        if isinstance(before, Diagnostic):
            return before
        differences = _differences(before, document)
        if differences:
            return _other(path, differences)
        if before == document and all((path / MISSION / name).exists() for name in files):
            return None
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    wrong = write_inside(path, SWEEP, text.encode())
    for name, content in files.items():
        wrong = wrong or write_inside(path, f"{MISSION}/{name}", content)
    return wrong


@contextmanager
def at_work(path: Path) -> Iterator[Journal | Diagnostic]:
    """Yield the locked journal of a folder, or the finding that it is in use."""
    with locked(path / JOURNAL, path, "another folder with `-o`") as journal:
        if isinstance(journal, Journal):
            journal.cut()
        yield journal


def _about(path: Path) -> dict[str, Any] | Diagnostic:
    content = _content(path, SWEEP)
    if isinstance(content, Diagnostic):
        return content
    if content is None:
        return _unreadable(path, f"it has no `{SWEEP}`", "name a folder that `missionc sweep` wrote")
    try:
        document = parse_record(content, SCHEMA)
    except NotJsonError as error:
        return _unreadable(path, f"its `{SWEEP}` cannot be read: {error.reason}", AGAIN)
    match document:
        case {"varied": dict() as varied, "seeds": int()} if all(map(_texts, varied.values())):
            return document
        case _:
            return _unreadable(path, f"its `{SWEEP}` has no `varied` or no `seeds`", AGAIN)


def _content(path: Path, name: str) -> bytes | Diagnostic | None:
    """Contents of a file in the folder; None if there is none; a finding if it is unreadable."""
    found = read_bytes(path / name, name, LARGEST, SWEEP_UNREADABLE)
    if isinstance(found, Absent):
        return None
    return found if isinstance(found, bytes) else _unreadable(path, found.message, AGAIN)


def _texts(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def _rows(path: Path) -> dict[Run, Row] | Diagnostic:
    content = _content(path, JOURNAL)
    if isinstance(content, Diagnostic):
        return content
    rows: dict[Run, Row] = {}
    lines = (content or b"").split(b"\n")
    for number, line in enumerate(lines[:-1], 1):  # text after the last line end is half a line
        row = _row(line)
        if isinstance(row, str):
            return _unreadable(path, f"line {number} of its `{JOURNAL}` is not a run: {row}", "remove the line")
        rows[row.run] = row
    return rows


def _row(line: bytes) -> Row | str:
    try:
        record = parse_record(line)
    except NotJsonError as error:
        return error.reason
    values, seed, outcome = record.pop("values", None), record.pop("seed", None), record.pop("outcome", None)
    host, sizes = record.pop("host", ""), record.pop("sizes", {})
    if not (isinstance(values, dict) and all(isinstance(each, str) for each in values.values())):
        return "its `values` are not texts"
    if type(seed) is not int or not isinstance(outcome, str) or outcome not in OUTCOMES:
        return "it has no `seed` or no valid `outcome`"
    if not (isinstance(sizes, dict) and all(type(each) is int for each in sizes.values())):
        return "its `sizes` are not whole numbers"
    if not all(isinstance(each, str | int | float) and not isinstance(each, bool) for each in record.values()):
        return "one of its values is neither a text nor a number"
    return Row(Run(tuple(values.items()), seed), RunResult(outcome, record, sizes), str(host))


def over(rows: Mapping[Run, Row]) -> dict[Run, Row]:
    """Runs that need no repetition: those without an abnormal end."""
    return {run: row for run, row in rows.items() if row.result.outcome != ERROR}


def _differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Differences between the definition of a sweep and that in its folder, in words.

    Empty if they are equal or more runs are added.
    """
    was, has = _flat(before), _flat(now)
    different = [
        f"`{name}` was {_brief(was.get(name))} and is now {_brief(has.get(name))}"
        for name in dict.fromkeys((*was, *has))
        if was.get(name) != has.get(name)
    ]
    old, new = before["varied"], now["varied"]
    if list(old) != list(new):
        different.append(f"`--vary` had {_brief(list(old))} and now has {_brief(list(new))}")
    else:
        different += [
            f"`--vary {name}` no longer has {_brief(missing[0])}"
            for name in old
            if (missing := [value for value in old[name] if value not in new[name]])
        ]
    if before["seeds"] > now["seeds"]:
        different.append(f"there were {before['seeds']} seeds and are now {now['seeds']}")
    return different


def _flat(document: Mapping[str, Any]) -> dict[str, Any]:
    """Entries of a definition that must not change; nested ones by both names: ``options.margin``."""
    found: dict[str, Any] = {}
    for name, value in document.items():
        if name not in ("varied", "seeds"):
            found |= (
                {f"{name}.{key}": each for key, each in value.items()} if isinstance(value, dict) else {name: value}
            )
    return found


def _brief(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:40]}…"


# ------------------------------------------------------------------ messages


def _other(path: Path, differences: list[str]) -> Diagnostic:
    more = len(differences) - SHOWN
    notes = (*differences[:SHOWN], *([f"and {more} more"] if more > 0 else []))
    help_ = "name another folder with `-o`"
    return Diagnostic(OTHER_SWEEP, f"`{shown(path)}` contains another sweep", None, notes=notes, help=help_)


def _unreadable(path: Path, why: str, way_out: str) -> Diagnostic:
    return Diagnostic(SWEEP_UNREADABLE, f"the sweep in `{shown(path)}` cannot be read", None, (), (why,), way_out)
