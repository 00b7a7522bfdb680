"""Impossibility certificates of missions in the corpus, and forged ones, correct except for one claim."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from missionc.backends.api import Budget
from missionc.backends.cover.refute import Refuted, refute
from missionc.backends.run_account import Account
from missionc.backends.smt.sat.proof import Proof, prove_cnf
from missionc.compiler import driver
from missionc.compiler.claim_cover import claimed
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.couplings import range_of
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.verification.impossibility.check_refutation import CNF, DRAT
from missionc.verification.impossibility.cover_document import COVER, ClaimedCover, document
from missionc.verification.impossibility.encode_formulas import Never, refutation

CORPUS = Path(__file__).parents[2] / "missions" / "both_sides"


@dataclass(frozen=True, slots=True)
class Certified:
    """Mission with a cover that refutes it."""

    mission: Mission
    kernel: Kernel
    cover: ClaimedCover

    @property
    def files(self) -> dict[str, bytes]:
        return files_of(self, self.cover)


@cache
def certified(name: str) -> Certified:
    """Refutation of ``impossible_NAME`` in the corpus by a cover."""
    checked = driver.check(CORPUS / f"impossible_{name}.mission")
    assert checked.mission is not None
    assert checked.kernel is not None
    ahead = looking_ahead(checked.mission, checked.kernel, 100_000)
    assert isinstance(ahead, Kernel)
    answer = refute(checked.mission, ahead, Budget(time.monotonic() + 60, work=6.0), Account())
    assert isinstance(answer, Refuted), answer
    cover, _ = claimed(answer.question, answer.conflict, checked.mission, checked.kernel)
    return Certified(checked.mission, checked.kernel, cover)


def files_of(known: Certified, cover: ClaimedCover) -> dict[str, bytes]:
    """Files of a cover's certificate, with its clauses and a proof of them."""
    goals = tuple(goal for goal in known.kernel.requirements if goal.name in cover.conflict)
    cnf = refutation(known.mission, goals, cover, _Believed(cover)).dimacs()
    proof = prove_cnf(cnf, Budget(time.monotonic() + 60))
    drat = proof.drat if isinstance(proof, Proof) else b""
    return {COVER: document(cover, known.mission), CNF: cnf, DRAT: drat}


class _Believed:
    """Labels of a cover in order, as its forger wants them read."""

    def __init__(self, cover: ClaimedCover) -> None:
        self.cover, self.left = cover, iter(cover.labels)
        self.known: dict[object, Never] = {}

    def own(self, predicate: Predicate, agent: int) -> Never:
        return self._next((predicate, self.cover.kind_of(agent)))

    def moves(self, predicate: Predicate, agent: int) -> Never:
        return self._next((predicate, self.cover.kind_of(agent), "moves"))

    def pair(self, predicate: Predicate, first: int, second: int) -> Never:
        return self._next((predicate, first, second))

    def link(self, graph: Graph, sender: int, receiver: int) -> Never:
        kinds = self.cover.kind_of(sender), self.cover.kind_of(receiver)
        return self._next((graph, kinds, range_of(graph, sender, receiver)))

    def _next(self, key: object) -> Never:
        if key not in self.known:
            label = next(self.left)
            self.known[key] = label.never_true, label.never_false
        return self.known[key]
