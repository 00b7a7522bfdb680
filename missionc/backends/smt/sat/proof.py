"""DRAT proofs of unsatisfiability: the CNF and a proof for independent checkers.

CaDiCaL writes the proof for the answer of any solver. Z3 can write proofs too, but checkers reject them because Z3
deletes clauses that it still uses.
"""

from __future__ import annotations

import subprocess
import time

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import Clauses, dimacs
from missionc.backends.smt.sat.solve import worker
from missionc.base.late_dataclass import Record

CNF, DRAT = "impossible.cnf", "impossible.drat"


class Proof(Record):
    """Clauses in DIMACS, with assumptions as unit clauses, and the DRAT proof of their unsatisfiability."""

    cnf: bytes
    drat: bytes


class Unproved(Record):
    """Reason why there is no proof."""

    statement: str


def certify(clauses: Clauses, assumptions: tuple[int, ...], budget: Budget, account: Account) -> None:
    """Add the files of a proof, or a note why there is none, to a run's account."""
    with account.stage("proof"):
        match prove(clauses, assumptions, budget):
            case Proof(cnf, drat):
                account.files |= {CNF: cnf, DRAT: drat}
            case Unproved(statement):
                account.notes.append(statement)


def prove(clauses: Clauses, assumptions: tuple[int, ...], budget: Budget) -> Proof | Unproved:
    """Proof that the clauses are unsatisfiable under the assumptions, from a new solver run; or the reason why there is
    none.

    Raises:
        RuntimeError: CaDiCaL has a model for clauses that another solver refused.
    """
    units = np.array([(literal, 0) for literal in assumptions], dtype=np.int32).ravel()
    flat = np.concatenate([clauses.everything(), units])
    proof = prove_cnf(dimacs(flat, clauses.variables, clauses.count + len(assumptions)), budget)
    if proof is None:
        raise RuntimeError("the solvers disagree: CaDiCaL has a model of clauses that another solver refuted")
    return proof


def prove_cnf(cnf: bytes, budget: Budget) -> Proof | Unproved | None:
    """Proof that clauses in DIMACS are unsatisfiable, from a child process; None if they have a model."""
    command = worker("proof", budget.memory_bytes, budget.seed)
    left = max(1.0, budget.deadline - time.monotonic())
    try:
        # In its own session, Ctrl-C on the terminal reaches only the parent.
        done = subprocess.run(  # noqa: S603
            command, input=cnf, capture_output=True, timeout=left, check=False, start_new_session=True
        )
    except subprocess.TimeoutExpired:
        return Unproved("no proof was written: the time limit was reached")
    if done.returncode:
        return Unproved("no proof was written: the solver for proofs ended early, probably for lack of memory")
    return Proof(cnf, done.stdout) if done.stdout else None
