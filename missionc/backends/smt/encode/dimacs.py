"""Text formats of clauses: DIMACS for solvers and proof checkers, SMT-LIB for readers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.backends.smt.encode.clauses import Literals


def dimacs(flat: Literals, variables: int, clauses: int) -> bytes:
    """DIMACS file of literals with a 0 after each clause."""
    return f"p cnf {variables} {clauses}\n".encode() + lines(flat, variables)


def lines(flat: Literals, variables: int) -> bytes:
    """DIMACS file without its header, which Z3's program does not need.

    Instead of a loop over literals, the text is gathered from a table with equal widths. The padding is then removed,
    since Z3 is slow on every character.
    """
    return np.take(_written(variables), flat + variables, axis=0, mode="clip").tobytes().translate(None, _FILL)


_FILL = b"\0"


def _written(variables: int) -> NDArray[np.uint64]:
    """Text of every literal from ``-variables`` on as a table, (literals, words of eight letters), integers."""
    digits = len(str(variables))
    width = -(-(digits + 2) // 8) * 8
    letters = np.zeros((2 * variables + 1, width), dtype=np.uint8)
    letters[:, -1] = ord(" ")
    size = np.abs(np.arange(-variables, variables + 1))
    sign = np.full(len(size), width - 2)
    for place in range(digits):
        written = size >= 10**place
        letters[written, width - 2 - place] = ord("0") + size[written] // 10**place % 10
        sign[written] = width - 3 - place
    letters[np.arange(variables), sign[:variables]] = ord("-")
    letters[variables, -2:] = list(b"0\n")
    return letters.view(np.uint64)


def smt2(flat: Literals, variables: int) -> str:
    """SMT-LIB text of the clauses; variable ``n`` is ``k!n``, Z3's name for it in a DIMACS file."""
    lines = ["(set-logic QF_FD)"]
    lines += [f"(declare-const k!{number} Bool)" for number in range(1, variables + 1)]
    for clause in np.split(flat, np.flatnonzero(flat == 0)[:-1] + 1):
        words = [f"k!{literal}" if literal > 0 else f"(not k!{-literal})" for literal in clause[:-1].tolist()]
        lines.append(f"(assert (or {' '.join(words)}))" if len(words) > 1 else f"(assert {words[0]})")
    lines.append("(check-sat)")
    return "\n".join(lines) + "\n"
