"""The trial of a number: its kind and its case. The same seed and number give the same trial."""

from __future__ import annotations

import numpy as np

from farm.kinds.drawings import DRAWINGS
from farm.kinds.full_disks import FULL_DISKS
from farm.kinds.killed_processes import KILLED_PROCESSES
from farm.kinds.lanes import LANES
from farm.kinds.lattice import LATTICE
from farm.kinds.mutated_files import MUTATED_FILES
from farm.kinds.mutated_folders import MUTATED_FOLDERS
from farm.kinds.mutated_texts import MUTATED_TEXTS
from farm.kinds.whole_missions import WHOLE_MISSIONS
from farm.trial import Case, Kind

KINDS = {
    kind.name: kind
    for kind in (
        *(WHOLE_MISSIONS, MUTATED_TEXTS, MUTATED_FILES, LANES),
        *(LATTICE, MUTATED_FOLDERS, KILLED_PROCESSES, FULL_DISKS, DRAWINGS),
    )
}
"""All kinds by name."""

TURNS = (
    *("mutated_texts", "whole_missions", "lattice", "mutated_texts", "killed_processes", "lanes", "drawings"),
    *("mutated_files", "whole_missions", "lattice", "mutated_texts", "full_disks", "mutated_folders"),
)
"""Kinds in turn in this order: fast ones are more frequent."""


def trial(seed: int, number: int) -> tuple[Kind, Case]:
    """Kind and case of a trial."""
    kind = KINDS[TURNS[number % len(TURNS)]]
    return kind, kind.draw(np.random.default_rng((seed, number)))
