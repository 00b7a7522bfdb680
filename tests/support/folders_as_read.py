"""Compiled folders as people read them: equality of two, and a command's output about one."""

from __future__ import annotations

import json
import re
import tempfile
import warnings
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from missionc.cli.app import main
from tests.support.forged_folders import laid
from tests.support.mutated_folders import mutated

PROVENANCE = ("backend", "seed", "versions", "cut_short", "options")
"""Entries of a manifest that cannot be computed; their consequences elsewhere are compared there."""

PLACES = 3
"""Decimals of a simulated flight's positions in metres that rounding does not affect."""


def outcome(found: Mapping[str, bytes], *words: str) -> tuple[int, str]:
    """Exit status and output of a command on a folder; a warning is an exception."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("error")
        folder = laid(Path(name) / "out", found)
        said = StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            status = main([words[0], str(folder), *words[1:], "--format", "json"])
        return status, said.getvalue()


def as_read(name: str, content: bytes) -> Any:
    """Readable contents of a document, for comparison."""
    if name.endswith((".skyc", ".mcap", ".bin")):
        return content
    if not name.endswith(".json"):
        # A number with fewer digits than written is the same number.
        return re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.7f}", content.decode())
    document = json.loads(content)
    if name == "manifest.json":
        return {key: value for key, value in document.items() if key not in PROVENANCE}
    if name == "simulation.json":
        # Without random values, every seed flies the same.
        agents = document["flight"]["agents"]
        places = {name: [[round(at, PLACES) for at in axis] for axis in axes] for name, axes in agents.items()}
        return {**document, "seed": 0, "flight": {**document["flight"], "agents": places}}
    if name == "certificate.json":
        # The boxes of a proof may be worse than necessary.
        return {key: value for key, value in document.items() if key != "boxes"}
    return document


def alike(one: Any, other: Any) -> bool:
    """Return whether values are equal, except for invisible differences of numbers."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(alike(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, float | int) and isinstance(other, float | int) and not isinstance(one, bool):
        return one == other or abs(one - other) <= 2e-5 + 1e-3 * abs(one)
    return type(one) is type(other) and one == other


def judged(files: Mapping[str, bytes], seed: int, of_plan: bool = True) -> tuple[str, str]:
    """Verdict of `verify` on a folder after one change, and the change.

    ``refused``, or ``accepted`` where the files say what they said; anything else is what should not be, in words. Of a
    proof that there is no plan, whatever `verify` accepts is one: it need not be the one that was written.
    """
    found, what = mutated(files, seed)
    status, said = outcome(found, "verify")
    if status not in (0, 1, 4, 5):
        return f"status {status}", f"{what}: {said[-600:]}"
    if status:
        codes = [each["code"] for each in json.loads(said)["diagnostics"]]
        return ("refused" if codes and "MC901" not in codes else f"refused with {codes}"), what
    for name, content in files.items() if of_plan else ():
        # An adapted manifest has other hashes.
        fits = name == "manifest.json" and not what.startswith(name)
        if not fits and not alike(as_read(name, found[name]), as_read(name, content)):
            return "accepted, and says something else", what
    return "accepted", what
