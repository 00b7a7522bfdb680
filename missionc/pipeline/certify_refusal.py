"""Certificate of impossibility: made of what a cover refused, and left only where it passes its own check.

in   what covers refused, Mission, its kernel
out  the files ``cover.json``, ``impossible.cnf`` and ``impossible.drat``; or a note why there are none
"""

from __future__ import annotations

from missionc.backends.api import Budget
from missionc.backends.cover.refute import Refused
from missionc.backends.run_account import Account
from missionc.backends.smt.sat.proof import CNF, DRAT, Unproved, prove_cnf
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.pipeline.claim_cover import claimed
from missionc.verify.impossibility.check_refutation import check_refutation
from missionc.verify.impossibility.cnf import TooManyClauses
from missionc.verify.impossibility.cover_document import COVER, document

NO_CERTIFICATE = "no certificate was left:"


def certify_refusal(refused: Refused, mission: Mission, kernel: Kernel, budget: Budget, account: Account) -> None:
    """Adds the files of a certificate to a run's account, or a note why there are none.

    Args:
        kernel: of the mission as it was written, with whatever looks back.
    """
    with account.stage("proof"):
        try:
            cover, clauses = claimed(refused.question, refused.conflict, mission, kernel)
        except TooManyClauses as error:
            account.notes.append(f"{NO_CERTIFICATE} {error}")
            return
        match prove_cnf(clauses.dimacs(), budget):
            case None:
                account.notes.append(f"{NO_CERTIFICATE} the clauses that are checked say less than those refused")
            case Unproved(statement):
                account.notes.append(statement)
            case proof:
                files = {COVER: document(cover, mission), CNF: proof.cnf, DRAT: proof.drat}
                failed = [
                    each
                    for each in check_refutation(mission, kernel, files, budget.limits, budget.deadline)
                    if not each.passed
                ]
                if failed:
                    first = failed[0]
                    account.notes.append(f"{NO_CERTIFICATE} {first.name} of {first.subject}: {first.detail}")
                else:
                    account.files |= files
