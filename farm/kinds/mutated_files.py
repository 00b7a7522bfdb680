"""The input files of a mission with one random change, in the check: findings must use the terms of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from farm.trial import MISSION, Broken, Case, Kind
from missionc.compiler.driver import check
from tests.support.mapped_missions import HEAD
from tests.support.mutated_files import SAID, faults, mutated_files


def draw(generator: np.random.Generator) -> Case:
    return Case({MISSION: HEAD + SAID, **mutated_files(int(generator.integers(2**31)))})


def carry_out(case: Case, folder: Path) -> str:
    checked = check(case.laid(folder))
    for fault in faults(checked):
        raise Broken("findings", "A finding about a file shows its position and quotes the file.", fault)
    return "read" if checked.ok else "refused"


MUTATED_FILES = Kind(
    "mutated_files",
    "files of places, points and lanes, one of them with a random change",
    draw,
    carry_out,
    60.0,
    of_text=False,
)
