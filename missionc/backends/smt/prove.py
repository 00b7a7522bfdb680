"""A proof, for others to check, that the clauses cannot hold: the CNF and a DRAT proof of it."""

from __future__ import annotations

import shutil
import subprocess
import sysconfig
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.smt.clauses import Clauses
from missionc.backends.smt.dimacs import dimacs

CNF, DRAT = "impossible.cnf", "impossible.drat"


@dataclass(frozen=True, slots=True)
class Proof:
    """The clauses, with what is assumed as clauses of one literal, and the proof."""

    cnf: bytes
    drat: bytes


@dataclass(frozen=True, slots=True)
class Unproved:
    """Why there is no proof."""

    statement: str


def prove(clauses: Clauses, assumptions: tuple[int, ...], budget: Budget) -> Proof | Unproved:
    """Solves once more from the beginning, by Z3's own program, which writes down each step."""
    program = shutil.which("z3", path=sysconfig.get_path("scripts")) or shutil.which("z3")
    if program is None:
        return Unproved("no proof was written: the program `z3`, which comes with z3-solver, was not found")
    units = np.array([(literal, 0) for literal in assumptions], dtype=np.int32).ravel()
    flat = np.concatenate([clauses.everything(), units])
    cnf = dimacs(flat, clauses.variables, clauses.count + len(assumptions))
    left = max(1.0, budget.deadline - time.monotonic())
    with tempfile.TemporaryDirectory(prefix="missionc-") as folder:
        problem, proof = Path(folder, CNF), Path(folder, DRAT)
        problem.write_bytes(cnf)
        command = [program, "-dimacs", f"-memory:{budget.memory_bytes >> 20}", f"sat.drat.file={proof}", str(problem)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=left, check=False)  # noqa: S603
        except subprocess.TimeoutExpired:
            return Unproved("no proof was written: the time limit came first")
        if b"UNSATISFIABLE" not in done.stdout or not proof.exists():
            return Unproved("no proof was written: the solver that writes proofs gave up")
        return Proof(cnf, proof.read_bytes())
