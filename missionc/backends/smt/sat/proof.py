"""DRAT proofs of unsatisfiability: the CNF and a proof, for others to check, that it has no model.

CaDiCaL writes it, whichever solver answered. Z3 can write one too, but what it
writes is refused by proof checkers: it drops clauses that it still uses.
"""

from __future__ import annotations

import subprocess
import time
from dataclasses import dataclass

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.dimacs import dimacs
from missionc.backends.smt.sat.solve import worker

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


def certify(clauses: Clauses, assumptions: tuple[int, ...], budget: Budget, account: Account) -> None:
    """Adds the files of a proof to a run's account, or why there is none."""
    with account.stage("proof"):
        match prove(clauses, assumptions, budget):
            case Proof(cnf, drat):
                account.files |= {CNF: cnf, DRAT: drat}
            case Unproved(statement):
                account.notes.append(statement)


def prove(clauses: Clauses, assumptions: tuple[int, ...], budget: Budget) -> Proof | Unproved:
    """Solves once more from the beginning.

    Raises:
        RuntimeError: CaDiCaL has a model of what another solver has refused.
    """
    units = np.array([(literal, 0) for literal in assumptions], dtype=np.int32).ravel()
    flat = np.concatenate([clauses.everything(), units])
    proof = prove_cnf(dimacs(flat, clauses.variables, clauses.count + len(assumptions)), budget)
    if proof is None:
        raise RuntimeError("the solvers disagree: CaDiCaL has a model of clauses that were refused")
    return proof


def prove_cnf(cnf: bytes, budget: Budget) -> Proof | Unproved | None:
    """A proof that clauses in DIMACS cannot all hold, from a child that writes down each step; None where they can."""
    command = worker("proof", budget.memory_bytes, budget.seed)
    left = max(1.0, budget.deadline - time.monotonic())
    try:
        # In a session of its own, Ctrl-C on the terminal is the parent's alone to act on.
        done = subprocess.run(  # noqa: S603
            command, input=cnf, capture_output=True, timeout=left, check=False, start_new_session=True
        )
    except subprocess.TimeoutExpired:
        return Unproved("no proof was written: the time limit was reached")
    if done.returncode:
        return Unproved("no proof was written: the solver that writes it ended early, most likely for want of memory")
    return Proof(cnf, done.stdout) if done.stdout else None
