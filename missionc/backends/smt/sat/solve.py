"""Parent side of the solver processes: sends clauses, and awaits answers within limits; children end with their
parent."""

from __future__ import annotations

import signal
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import TypeAlias

import numpy as np

from missionc.backends.api import Reason
from missionc.backends.smt.encode.clauses import Clauses, Literals, dimacs
from missionc.backends.smt.sat.presolve import Presolver, program
from missionc.backends.smt.sat.solver_process import Process, is_over, wait
from missionc.backends.smt.settings import SolverSettings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags

DEFAULTS = SolverSettings()

WORKER = Path(__file__).with_name("worker.py")

SOLVERS = {"auto": ("z3",), "z3": ("z3",), "cadical": ("cadical",), "race": ("z3", "cadical")}
"""Child processes that each value of ``--solver`` starts."""

RELIEF = {"auto": "cadical"}
"""Second solver that takes turns with the first, if installed, by value of ``--solver``."""

PACKAGES = {"z3": "z3", "cadical": "pysat", "proof": "pysat"}
"""Python package of each solver in the worker."""


def for_refusals(solver: str) -> str:
    """Value of ``--solver`` for queries that are mostly refused: CaDiCaL if the choice is open and CaDiCaL is
    installed.

    CaDiCaL refuses covers with fewer conflicts than Z3: for ten agents in a chain 7,500, while Z3 needs more than
    20,000.
    """
    other = RELIEF.get(solver, "")
    return other if other and package_folder(PACKAGES[other]) else solver


OUT_OF_MEMORY = {-signal.SIGABRT, -signal.SIGKILL, -signal.SIGSEGV, 101}
"""Exit statuses of a child that ran out of memory: a signal, or Z3's own status."""


class Satisfiable(Record):
    """Answer that there is a model; ``Solvers.values`` reads it."""


class Unsatisfiable(Record):
    """Answer that there is no model, with the assumptions in the core."""

    core: tuple[int, ...]


class Stopped(Record):
    """Outcome without an answer, with the reason."""

    reason: Reason
    detail: str
    paused: bool = False
    """True if the conflict limit was reached: the query may be repeated, with the solver's learned clauses."""


Answer: TypeAlias = Satisfiable | Unsatisfiable | Stopped


class ChildEnded(Exception):
    """Exception: the child closed its pipe, because it died, or after it reported an error."""


class Child(Process):
    """Incremental solver in a separate process."""

    def __init__(self, name: str, memory_bytes: int, seed: int) -> None:
        super().__init__(worker(name, memory_bytes, seed))
        self.name = name
        self.told = 0
        """Position in the clause list up to which the child has the clauses."""
        self.limit: int | None = None
        """Conflict limit that the child has; None for no limit."""
        self._received = b""

    def begin(self) -> None:
        """Remove all clauses from the child."""
        self.told, self.limit = 0, None
        self.send(b"N", b"")

    def allow(self, conflicts: int | None) -> None:
        """Set the conflict limit; None for no limit."""
        unlimited = 2**31 - 1  # above any solver's conflicts
        if conflicts != self.limit:
            self.limit = conflicts
            most = unlimited if conflicts is None else min(conflicts, unlimited)
            self.send(b"C", np.array([most], dtype=np.int32).tobytes())

    def send(self, kind: bytes, payload: bytes) -> None:
        """Send a message: its letter and its content."""
        self.outbox.put(kind + len(payload).to_bytes(8, "little") + payload)

    def receive(self) -> None:
        """Read the available output of the child.

        Raises:
            ChildEnded: the child has ended.
        """
        data = self.read()
        if not data:
            raise ChildEnded
        self._received += data

    def next_message(self) -> tuple[bytes, bytes] | None:
        """Next complete message of the child, its letter and its content; None if it is incomplete."""
        end = 9 + int.from_bytes(self._received[1:9], "little")
        if len(self._received) < max(end, 9):
            return None
        message, self._received = self._received[:end], self._received[end:]
        return message[:1], message[9:]


class Solvers:
    """Solver processes of one run; as a context manager, it ends all processes.

    A presolve answers most queries. The incremental children are started at the first query that it does not answer;
    the first child that answers is retained.

    Args:
        presolve: conflict limit of presolves; 0 disables them.
    """

    def __init__(
        self, solver: str, memory_bytes: int, seed: int, deadline: float, *, presolve: int = DEFAULTS.presolve_conflicts
    ) -> None:
        self.deadline = deadline
        self.peak_bytes = 0
        self.conflicts = 0
        """Number of conflicts of all queries, answered or not."""
        self.answered = ""
        """Name of the solver that had the last model."""
        self.cut = False
        """True if a query was abandoned because time was up or a signal arrived."""
        self._solver, self._memory_bytes, self._seed, self._presolve = solver, memory_bytes, seed, presolve
        self._z3 = program(package_folder(PACKAGES["z3"])) if presolve and "z3" in SOLVERS[solver] else None
        self._presolver = self._new_presolver()  # it starts while the roadmaps are built
        self._children: list[Child] = []
        self._relief: Child | None = None
        """Solver that takes turns with the only child, while it is not its turn; started at its first turn."""
        self._relieved = RELIEF[solver] if solver in RELIEF and package_folder(PACKAGES[RELIEF[solver]]) else ""
        self._started = False

    def __enter__(self) -> Solvers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End every process; no further queries are possible."""
        self._started = True
        self._replace_presolver(None)
        self._keep(())
        if self._relief is not None:
            self._relief.close()
            self.peak_bytes = max(self.peak_bytes, self._relief.peak_bytes)
            self._relief = None

    @property
    def takes_turns(self) -> bool:
        """True if another solver can be queried when the current solver does not answer."""
        return bool(self._relieved)

    def relieve(self) -> None:
        """Switch to the other solver; the current solver keeps its state for its next turn."""
        if not self._relieved or len(self._children) != 1:
            return
        child = self._relief or Child(self._relieved, self._memory_bytes, self._seed)
        self._relief, self._children = self._children[0], [child]

    @property
    def alive(self) -> bool:
        return bool(self._children) or not self._started

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(child.name for child in self._children)

    def begin(self) -> None:
        """Start a new problem: previous clauses are dropped."""
        for child in (*self._children, *([self._relief] if self._relief else [])):
            child.begin()
        if self._presolver is None or self._presolver.told:
            self._replace_presolver(self._new_presolver())

    def show(self, clauses: Clauses) -> None:
        """Send the clauses so far to the next presolve, which reads them in the meantime."""
        if self._presolver is not None:
            self._presolver.tell(clauses)

    def presolve(self, clauses: Clauses, assumptions: tuple[int, ...]) -> Flags | Unsatisfiable | None:
        """Presolve of all clauses under the assumptions.

        Returns:
            truth of the variables in a model, (variables + 1,), with index 0 unused; or a refusal with all assumptions
            as core; or None if undecided.
        """
        presolver = (self._presolver or self._new_presolver()) if self.alive else None
        if presolver is None:
            return None
        self._presolver = presolver
        seen = presolver.ask(clauses, assumptions, self.deadline)
        self._replace_presolver(None)
        if seen.model is not None:
            self.answered = "z3"
        return Unsatisfiable(assumptions) if seen.refused else seen.model

    def start(self) -> None:
        """Start the incremental solvers, unless they run already."""
        if not self._started:
            self._children = [Child(name, self._memory_bytes, self._seed) for name in SOLVERS[self._solver]]
        self._started = True

    def add(self, clauses: Clauses) -> None:
        """Send the new clauses to the incremental solvers."""
        few = 1_000  # number of literals up to which calls of Z3 are faster than text
        self.start()
        text = b""
        for child in self._children:
            new, child.told = clauses.since(child.told)
            if not new.size:
                continue
            if child.name == "z3" and len(new) > few:
                text = text or dimacs(new, clauses.variables, int((new == 0).sum()))
                child.send(b"A", text)
            else:
                child.send(b"L", new.tobytes())

    def solve(
        self, assumptions: tuple[int, ...], deadline: float | None = None, conflicts: int | None = None
    ) -> Answer:
        """Answer to the query for a model under the assumptions.

        Args:
            deadline: earlier end of the query on the clock of ``time.monotonic``, seconds.
            conflicts: conflict limit of a solver; racing solvers may exceed it.
        """
        if len(self._children) == 1:
            self._children[0].allow(conflicts)
        payload = np.array(assumptions, dtype=np.int32).tobytes()
        answer = self._ask(b"S", payload, min(self.deadline, deadline or self.deadline))
        if isinstance(answer, Stopped):
            return answer
        self.conflicts += int(np.frombuffer(answer[1:5], dtype=np.int32)[0])
        detail = answer[5:]
        match answer[:1]:
            case b"s":
                self.answered = self._children[0].name
                return Satisfiable()
            case b"u":
                return Unsatisfiable(tuple(np.frombuffer(detail, dtype=np.int32).tolist()))
            case _:
                return _gave_up(detail.decode(errors="replace"), paused=conflicts is not None)

    def values(self, variables: Literals) -> Flags | Stopped:
        """Truth of variables in the last model: (variables,) -> (variables,); or the reason why it is not available."""
        answer = self._ask(b"V", variables.astype(np.int32).tobytes(), self.deadline)
        return answer if isinstance(answer, Stopped) else np.frombuffer(answer, dtype=np.uint8).astype(bool)

    def _ask(self, kind: bytes, payload: bytes, deadline: float) -> bytes | Stopped:
        for child in self._children:
            child.send(kind, payload)
        stopped = Stopped(Reason.SOLVER, "no solver is left")
        while self._children:
            ready = wait(self._children, deadline)
            if not ready:
                self.cut = self.cut or is_over(self.deadline)
                self._keep(())
                return Stopped(Reason.TIME, "")
            for child in ready:
                answer = _answer(child, kind)
                if isinstance(answer, bytes):
                    self._keep((child,))
                    return answer
                if isinstance(answer, str):
                    stopped = self._dropped(child, answer)
        return stopped

    def _dropped(self, child: Child, detail: str) -> Stopped:
        """Remove a child that ended, and return the reason; other children continue."""
        self._keep(tuple(other for other in self._children if other is not child))
        if not detail and child.process.returncode in OUT_OF_MEMORY:
            detail = "memory"
        return _gave_up(detail or f"the solver ended with status {child.process.returncode}")

    def _new_presolver(self) -> Presolver | None:
        return None if self._z3 is None else Presolver(self._z3, self._memory_bytes, self._seed, self._presolve)

    def _replace_presolver(self, presolver: Presolver | None) -> None:
        """End the current presolver and set the next (None: no presolver)."""
        if self._presolver is not None:
            self._presolver.close()
            self.peak_bytes = max(self.peak_bytes, self._presolver.peak_bytes)
        self._presolver = presolver

    def _keep(self, children: tuple[Child, ...]) -> None:
        for child in self._children:
            if child not in children:
                child.close()
                self.peak_bytes = max(self.peak_bytes, child.peak_bytes)
        self._children = list(children)


def _answer(child: Child, kind: bytes) -> bytes | str | None:
    """Answer of a child, or the text of its error (empty if it died); None if the answer is incomplete."""
    try:
        child.receive()
    except ChildEnded:
        return ""
    while message := child.next_message():
        letter, payload = message
        if letter == kind:
            return payload
        if letter == b"E":
            return payload.decode(errors="replace")
    return None


def worker(what: str, memory_bytes: int, seed: int) -> list[str]:
    """Command that starts a child; without ``site`` and environment, the child is ready a fifth sooner."""
    limits = str(memory_bytes), str(seed)
    return [sys.executable, "-I", "-S", str(WORKER), what, *limits, package_folder(PACKAGES[what])]


@cache
def package_folder(package: str) -> str:
    """Folder that contains a Python package; empty if the package is missing."""
    spec = find_spec(package)
    return "" if spec is None or spec.origin is None else str(Path(spec.origin).parent.parent)


def _gave_up(detail: str, *, paused: bool = False) -> Stopped:
    if "memory" in detail:
        return Stopped(Reason.MEMORY, detail)
    return Stopped(Reason.SOLVER, detail, paused and "conflicts" in detail)
