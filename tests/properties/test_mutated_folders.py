"""A compiled folder with one place changed, by chance: refused with a code, or the same in all that people read."""

from __future__ import annotations

import json
import re
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from missionc.cli.app import main
from tests.support.forged_folders import laid
from tests.support.mutated_folders import mutated
from tests.support.whole_folder import files

pytestmark = pytest.mark.usefixtures("flown_once")

BLOCKS = 5
EACH = 8

PROVENANCE = ("backend", "seed", "versions", "cut_short", "options")
"""Entries of a manifest that nobody can compute; what follows from some of them elsewhere is compared there."""

PLACES = 3
"""Digits after the point of a simulated flight's places, in metres, that rounding leaves alone."""


def outcome(found: Mapping[str, bytes], *words: str) -> tuple[int, str]:
    """The exit status of a command on a folder, and what it said; a warning is an exception."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("error")
        folder = laid(Path(name) / "out", found)
        said = StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            status = main([words[0], str(folder), *words[1:], "--format", "json"])
        return status, said.getvalue()


def as_read(name: str, content: bytes) -> Any:
    """What people read of a document, for comparing."""
    if name.endswith((".skyc", ".mcap", ".bin")):
        return content
    if not name.endswith(".json"):
        # A number with fewer digits than it was written with is the same number.
        return re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.7f}", content.decode())
    document = json.loads(content)
    if name == "manifest.json":
        return {key: value for key, value in document.items() if key not in PROVENANCE}
    if name == "simulation.json":
        # Where nothing is drawn every seed flies the same.
        agents = document["flight"]["agents"]
        places = {name: [[round(at, PLACES) for at in axis] for axis in axes] for name, axes in agents.items()}
        return {**document, "seed": 0, "flight": {**document["flight"], "agents": places}}
    if name == "certificate.json":
        # The boxes of a proof may be worse than they need to be.
        return {key: value for key, value in document.items() if key != "boxes"}
    return document


def alike(one: Any, other: Any) -> bool:
    """The same, but for what nobody can see of a number."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(alike(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, float | int) and isinstance(other, float | int) and not isinstance(one, bool):
        return one == other or abs(one - other) <= 2e-5 + 1e-3 * abs(one)
    return type(one) is type(other) and one == other


def judged(seed: int) -> tuple[str, str]:
    """``refused`` or ``accepted``, and what was done."""
    found, what = mutated(files(), seed)
    status, said = outcome(found, "verify")
    assert status in (0, 1, 5), f"{seed}: {what}: {status}: {said[-600:]}"
    if status:
        codes = [each["code"] for each in json.loads(said)["diagnostics"]]
        assert codes, f"{seed}: {what}"
        assert "MC901" not in codes
        return "refused", what
    for name, content in files().items():
        # A manifest that was made to fit has other hashes.
        if name != "manifest.json" or what.startswith(name):
            assert alike(as_read(name, found[name]), as_read(name, content)), f"{seed}: {what}: accepted"
    return "accepted", what


@pytest.mark.parametrize("block", range(BLOCKS))
def test_a_folder_changed_by_chance_is_refused_or_says_the_same(block: int) -> None:
    outcomes = [judged(block * EACH + number)[0] for number in range(EACH)]
    assert set(outcomes) <= {"refused", "accepted"}


if __name__ == "__main__":
    first, last = map(int, sys.argv[1:3])
    counted: Counter[str] = Counter()
    for seed in range(first, last):
        try:
            verdict, what = judged(seed)
        except Exception as error:
            verdict, what = "EXCEPTION", f"{type(error).__name__}: {str(error)[:1500]}"
        counted[verdict] += 1
        if verdict != "refused":
            print(seed, verdict, what, flush=True)
    print(dict(counted))
