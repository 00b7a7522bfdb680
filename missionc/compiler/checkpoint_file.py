"""Checkpoint file: an npz of plain arrays, one of which is a JSON text; its content is never executed.

    in   Snapshot, and its run
    out  bytes; and back
    says MC706 MC707

The arrays are stored uncompressed, so that none can be larger than the file.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from collections.abc import Mapping

import numpy as np

from missionc.backends.api import Snapshot
from missionc.base.diagnostics.code import CHECKPOINT_MISMATCH, CHECKPOINT_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.strict_json import NotJsonError, parse_record
from missionc.base.trace import Array

SCHEMA = "missionc.checkpoint/1"

WORDS = "words"
"""Name of the array with the JSON text."""

MOST_ARRAYS = 64

Identity = Mapping[str, str]
"""Inputs that identify a run, by name, in the order of reports: versions, the mission, its options."""


def to_bytes(snapshot: Snapshot, run: Identity) -> bytes:
    """Content of a checkpoint file; equal snapshots give equal bytes."""
    about = {"schema": SCHEMA, "run": dict(run), "words": snapshot.words, "arrays": sorted(snapshot.arrays)}
    text = np.frombuffer(json.dumps(about, allow_nan=False).encode(), dtype=np.uint8)
    arrays = {name: np.ascontiguousarray(array, dtype=np.float64) for name, array in snapshot.arrays.items()}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **{WORDS: text}, **arrays)
    return file.getvalue()


def from_bytes(content: bytes, name: str, run: Identity) -> Snapshot | Diagnostic:
    """Snapshot in a checkpoint file, or a diagnostic if the file is damaged or belongs to another run.

    Args:
        name: name of the file in messages.
    """
    try:
        arrays = _arrays(content)
        about = parse_record(arrays.pop(WORDS).tobytes())
        schema, saved_run, words = str(about["schema"]), dict(about["run"]), dict(about["words"])
        if schema == SCHEMA and sorted(arrays) != about["arrays"]:
            raise _DamagedError("arrays are missing")
    except Exception as wrong:  # of whatever unpacks it, too
        ours = isinstance(wrong, _DamagedError | NotJsonError)
        return unreadable(name, str(wrong) if ours else "the file is damaged or not a checkpoint")
    if schema != SCHEMA:
        return _of_another(name, f"its schema is `{schema[:40]}`; this version writes `{SCHEMA}`", "")
    different = difference(saved_run, run)
    return _different(name, *different) if different else Snapshot(arrays, words)


def difference(saved: Mapping[str, object], now: Identity) -> tuple[str, str] | None:
    """First difference between the inputs of two runs: its name, and a sentence; None if they are equal."""
    for what in (*now, *saved):
        if now.get(what) != saved.get(what):
            values = (saved.get(what), now.get(what))
            there, here = (f"`{str(value)[:60]}`" if value is not None else "not set" for value in values)
            return what, f"the {what} is {there} in the checkpoint and {here} in this run"
    return None


class _DamagedError(ValueError):
    """Error: a checkpoint is damaged; the text names the damage."""


def _arrays(content: bytes) -> dict[str, Array]:
    """Arrays in an npz file, with any shape and unit; stated sizes in bytes are checked before use.

    Raises:
        Exception: it is not such a file, or it is damaged.
    """
    arrays = {}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        if len(members) > MOST_ARRAYS or sum(member.file_size for member in members) > len(content):
            raise _DamagedError("its stated size exceeds the file")
        for member in members:
            if member.compress_type != zipfile.ZIP_STORED or not member.filename.endswith(".npy"):
                raise _DamagedError(f"`{member.filename[:40]}` is not a plain array")
            name = member.filename.removesuffix(".npy")
            arrays[name] = _array(archive.read(member), "|u1" if name == WORDS else "<f8")
    return arrays


def _array(data: bytes, kind: str) -> Array:
    file = io.BytesIO(data)
    if np.lib.format.read_magic(file) != (1, 0):
        raise _DamagedError("an array has another format")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    if dtype.str != kind or fortran or math.prod(shape) * dtype.itemsize != len(data) - file.tell():
        raise _DamagedError("an array does not match its header")
    array: Array = np.load(io.BytesIO(data), allow_pickle=False)
    if not np.isfinite(array).all():
        raise _DamagedError("a number is not finite")
    return array


# ---------------------------------------------------------------- messages


def unreadable(name: str, why: str) -> Diagnostic:
    return Diagnostic(
        CHECKPOINT_UNREADABLE,
        f"`{name}` is not a usable checkpoint",
        None,
        notes=(why[:200],),
        help="name a file written by `--checkpoint`",
    )


def _different(name: str, what: str, why: str) -> Diagnostic:
    if what == "mission":
        return _of_another(name, "the mission is different or has changed", "")
    return _of_another(name, why, f"use the same {what}")


def _of_another(name: str, why: str, instead: str) -> Diagnostic:
    return Diagnostic(
        CHECKPOINT_MISMATCH,
        f"`{name}` belongs to another run",
        None,
        notes=(why,),
        help=instead or "start without `--resume`",
    )
