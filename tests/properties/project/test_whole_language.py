"""Random missions of the whole language go through every command: each answers, and the answers agree.

``MISSIONC_FUZZ=2000`` takes so many instead of the usual number; `make fuzz` does.
"""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.support.every_command import taken_through
from tests.support.random_language_missions import random_program

pytest.importorskip("torch")

USUAL = 20
FIRST = 20_000
SECONDS = "0.5"
PLANNED = (20_007, 20_020)
"""Missions that have a plan: these get as long as they need, however busy the machine is."""
PRESETS = ("search", "paper", "fsot", "mpot")


def flags(seed: int, text: str) -> tuple[str, ...]:
    """For ``compile``; a search that finds nothing in its time is an answer too."""
    found = ["--time-limit", "300" if seed in PLANNED else SECONDS, "--explain-limit", "1" if seed % 8 == 1 else "0"]
    found += ["--continuous"] if seed % 4 == 0 else []
    found += ["--alternatives", "3"] if seed % 3 == 0 else []
    if "solve with clot" in text and seed % 2:
        found += ["--preset", PRESETS[seed // 2 % len(PRESETS)], "--samples", "4"]
    return tuple(found)


@pytest.mark.timeout(0)
def test_every_command_has_an_answer_to_every_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MISSIONC_TRACEBACK", "1")
    count = int(os.environ.get("MISSIONC_FUZZ", USUAL))
    outcomes: Counter[str] = Counter()
    for seed in range(FIRST, FIRST + count):
        files = random_program(np.random.default_rng(seed))
        try:
            ended = taken_through(files, tmp_path / str(seed), flags(seed, files["m.mission"]))
        except BaseException as error:
            error.add_note(f"mission {seed}:\n" + "\n".join(files.values()))
            raise
        outcomes[ended.outcome] += 1
        assert ended.outcome == "planned" or seed not in PLANNED
    assert set(outcomes) <= {"planned", "refused", "impossible", "undecided"}
    print(dict(outcomes))


def test_the_same_seed_draws_the_same_program() -> None:
    first, again, other = (random_program(np.random.default_rng(seed)) for seed in (7, 7, 8))
    assert first == again != other
