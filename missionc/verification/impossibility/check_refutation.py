"""Check of a certificate of impossibility, without trust in its producer.

in   Mission, its kernel, the certificate's files
out  Checks

The check shares no code with planning or covers. It checks cells, moves and labels with interval arithmetic, derives
the clauses again from them and the mission, and follows the proof step by step.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence

from dratify import DRATChecker, parse_dimacs, parse_proof

from missionc.base.limits import Limits
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import MOTION, Check
from missionc.verification.impossibility.check_bodies import CheckedLabels, check_boxes, check_pairs, check_rooms
from missionc.verification.impossibility.check_motion import (
    MotionLimits,
    check_absent,
    check_moves,
    check_space,
    check_turns,
    check_visits,
    limits_of,
)
from missionc.verification.impossibility.cnf import Cnf, TooManyClauses
from missionc.verification.impossibility.cover_document import COVER, ClaimedCover, Unreadable, read_cover
from missionc.verification.impossibility.encode_formulas import refutation

CNF, DRAT = "impossible.cnf", "impossible.drat"

SPACES = b" \t\n\r\v\f\x1c\x1d\x1e\x1f"
"""Whitespace characters that end a number in a proof file, including line ends."""

_END = re.compile(rb"(?:^|\s)d?[-+]?0+(?=\s|$)")
"""Pattern of the zero that ends a clause."""


def check_refutation(
    mission: Mission, kernel: Kernel, files: Mapping[str, bytes], limits: Limits, deadline: float = math.inf
) -> tuple[Check, ...]:
    """Checks of the proof that no motion satisfies the requirements named by the cover.

    Args:
        files: content of the certificate's files, by name.
        deadline: on the monotonic clock; a proof that is not checked by then is rejected.
    """
    try:
        cover = read_cover(files[COVER].decode("utf-8", errors="replace"), mission)
        checks, clauses = check_cover(mission, kernel, cover)
    except (Unreadable, TooManyClauses) as error:
        return (_check("cover", COVER, [str(error)]),)
    if clauses.dimacs() != files.get(CNF):
        return (*checks, _check("clauses", CNF, ["its clauses do not match this cover and this mission"]))
    return (*checks, _check("clauses", CNF, []), check_drat(files, limits, deadline))


def check_cover(mission: Mission, kernel: Kernel, cover: ClaimedCover) -> tuple[tuple[Check, ...], Cnf]:
    """Checks that a cover excludes no possible motion, and the clauses that follow from it for its requirements.

    Raises:
        Unreadable: it is not a cover of this mission.
    """
    goals = tuple(goal for goal in kernel.requirements if goal.name in cover.conflict)
    if len(goals) != len(set(cover.conflict)):
        raise Unreadable("it names requirements that the mission does not have")
    if not set(cover.asked) <= cover.absent.keys():
        raise Unreadable("it does not state the cells of its agents")
    labels = CheckedLabels(mission, cover)
    clauses = refutation(mission, goals, cover, labels)
    checks = (*_of_motion(mission, cover, limits_of(mission, goals)), _check("labels", "all", labels.faults))
    return checks, clauses


def _of_motion(mission: Mission, cover: ClaimedCover, limits: tuple[MotionLimits, ...]) -> Iterator[Check]:
    yield _check("bodies", "all", check_boxes(mission, cover))
    for kind in cover.kinds:
        name, own = mission.agents[kind.agents[0]].name, [limits[agent] for agent in kind.agents]
        yield _check("cells", name, check_space(mission, cover, kind))
        yield _check("moves", name, (fault for each in own for fault in check_moves(mission, kind, each)))
        yield _check("turns", name, (fault for each in own for fault in check_turns(mission, kind, each)))
    for agent in (mission.agents[number] for number in cover.asked):
        yield _check("places", agent.name, check_absent(mission, cover, agent, limits[agent.index]))
        if agent.index in cover.not_both:
            yield _check("visits", agent.name, check_visits(mission, cover, agent, limits[agent.index]))
    if cover.apart:
        yield _check("rooms", "all", check_rooms(mission, cover))
        for pair in cover.not_together:
            names = ", ".join(mission.agents[agent].name for agent in pair)
            yield _check("pairs", names, check_pairs(mission, cover, pair))


def conflict_of(files: Mapping[str, bytes], mission: Mission) -> tuple[str, ...]:
    """Names of the requirements that a certificate proves infeasible together; empty if it cannot be read."""
    try:
        return read_cover(files[COVER].decode("utf-8", errors="replace"), mission).conflict
    except Unreadable:
        return ()


def check_drat(files: Mapping[str, bytes], limits: Limits, deadline: float = math.inf) -> Check:
    """Check, step by step, of the proof that the clauses are unsatisfiable.

    Each step must follow by unit propagation. Steps that only preserve satisfiability (RAT) are rejected: their check
    would involve deleted clauses from which literals were propagated.

    Args:
        deadline: on the monotonic clock; a proof that is not checked by then is rejected.
    """
    return _check("proof", DRAT, _faults_of_proof(files, limits, deadline))


class _TooLateError(Exception):
    """The deadline passed during the check of a proof."""


def _faults_of_proof(files: Mapping[str, bytes], limits: Limits, deadline: float) -> Iterator[str]:
    proof, clauses = files.get(DRAT, b""), files.get(CNF, b"")
    if not (proof.isascii() and clauses.isascii()):
        yield "it is not ASCII text"
        return
    literals = sum(len(each) - len(each.translate(None, SPACES)) for each in (proof, clauses))
    if literals > limits.proof_literals:
        yield f"it has {literals} literals; raise the limit with `--limit proof_literals={literals}`"
        return
    steps = max(proof.count(b"\n"), sum(1 for _ in _END.finditer(proof)))
    if steps > limits.proof_steps:
        yield f"it has {steps} steps; raise the limit with `--limit proof_steps={steps}`"
        return
    try:
        formula = parse_dimacs(clauses.decode())
        if formula.nvars > len(clauses):
            raise ValueError("its header states more variables than its clauses use")
        steps_until = _until(deadline, formula.nvars, parse_proof(proof.decode()))
        result = DRATChecker(formula, check_rat=False).check(steps_until)
    except ValueError as error:
        yield f"it cannot be read: {str(error)[:200]}"
    except _TooLateError:
        yield "the time limit was reached before the end of the proof"
    else:
        if not result.ok:
            yield str(result)


def _until(
    deadline: float, variables: int, steps: Iterable[tuple[str, Sequence[int]]]
) -> Iterator[tuple[str, Sequence[int]]]:
    """Yield the steps of a proof until the deadline.

    Raises:
        _TooLateError: the deadline has passed.
        ValueError: a step has a variable that occurs in no clause.
    """
    for kind, literals in steps:
        if time.monotonic() >= deadline:
            raise _TooLateError
        if any(literal >> 1 >= variables for literal in literals):
            raise ValueError("a step uses a variable without a clause")
        yield kind, literals


def _check(name: str, subject: str, faults: Iterable[str]) -> Check:
    found = next(iter(faults), "")
    return Check(name, subject, 0.0, "m", MOTION, not found, detail=found)
