"""Presolve with a conflict limit by Z3's own program: easy problems are answered before a solver is ready.

The program reads DIMACS text directly into Z3's clause solver, and solves ten thousand clauses before the library has
made its terms. The program answers one query only, supports no assumptions and gives no core. It therefore runs only
briefly, and undecided queries go to a full solver.
"""

from __future__ import annotations

import os
import sysconfig
from functools import cache
from pathlib import Path

import numpy as np

from missionc.backends.smt.encode.clauses import Clauses, lines
from missionc.backends.smt.sat.solver_process import Process, wait
from missionc.backends.smt.sat.worker import PARAMETERS
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags

YES, NO = b"s SATISFIABLE", b"s UNSATISFIABLE"


class PresolveAnswer(Record, eq=False):
    """Answer of a presolve.

    ``model`` is the truth of every variable, (variables + 1,), with index 0 unused; None if no model was found.
    ``refused`` is true if the clauses are proved to have no model.
    """

    model: Flags | None
    refused: bool


class Presolver(Process):
    """Process that presolves one query; it reads clauses while they are made."""

    def __init__(self, z3: Path, memory_bytes: int, seed: int, conflicts: int) -> None:
        settings = {**PARAMETERS, "random_seed": str(seed % 2**31), "max_conflicts": str(conflicts)}
        command = [str(z3), "-dimacs", "-in", f"-memory:{max(1, memory_bytes >> 20)}"]
        super().__init__(command + [f"sat.{name}={value}" for name, value in settings.items()])
        self._told = 0

    @property
    def told(self) -> bool:
        """True if the process has read clauses."""
        return self._told > 0

    def tell(self, clauses: Clauses) -> None:
        """Send the clauses that are new since the last call."""
        new, self._told = clauses.since(self._told)
        if new.size:
            self.outbox.put(lines(new, clauses.variables))

    def ask(self, clauses: Clauses, assumptions: tuple[int, ...], deadline: float) -> PresolveAnswer:
        """Model under the assumptions, or their refusal, if found within the conflict limit.

        Args:
            deadline: end of the query on the clock of ``time.monotonic``, seconds.
        """
        self.tell(clauses)
        self.weigh()  # while it surely runs; after its answer it may be gone
        self.outbox.put("".join(f"{literal} 0\n" for literal in assumptions).encode())
        self.outbox.end()
        verdict, _, model = self._said(deadline).partition(b"\n")
        if verdict != YES:
            return PresolveAnswer(None, verdict == NO)
        numbers = np.array(model.replace(b"v", b"").split(), dtype=np.int32)
        holds = np.zeros(clauses.variables + 1, dtype=np.bool_)
        holds[numbers[numbers > 0]] = True
        return PresolveAnswer(holds, False)

    def _said(self, deadline: float) -> bytes:
        """Output of the process; empty if it does not end before the deadline."""
        output = b""
        while wait([self], deadline):
            self.weigh()
            more = self.read()
            if not more:
                return output
            output += more
        return b""


@cache
def program(folder: str) -> Path | None:
    """Path of Z3's program in the package in this folder; None if missing."""
    places = Path(folder, "../../../bin/z3").resolve(), Path(sysconfig.get_path("scripts"), "z3.exe")
    return next((place for place in places if place.is_file() and os.access(place, os.X_OK)), None)
