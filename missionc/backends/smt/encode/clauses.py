"""Clause list: a conjunctive normal form that every solver reads.

Literals are integers as in DIMACS: a variable, or its negative. Variable 1 is true, so that a constant is an ordinary
literal; all methods fold constants. Clauses are built from arrays, never one by one.

A literal for a formula is defined in one direction: if the literal is true, the formula is true. This suffices for
positive occurrences, as in ``lower``, and halves the number of clauses.

Source:
    Plaisted and Greenbaum, "A structure-preserving clause form translation", 1986.

Text formats of clauses: DIMACS for solvers and proof checkers, SMT-LIB for readers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Indices

Literals = NDArray[np.int32]

TRUE, FALSE = 1, -1

NOTHING = 0
"""Padding of shorter rows in a matrix of literals."""

_END = np.iinfo(np.int32).min


class TooLarge(Exception):
    """Exception: the next clauses would exceed the limit on their number."""

    def __init__(self, clauses: int, made: int) -> None:
        super().__init__(f"at least {clauses} clauses")
        self.clauses, self.made = clauses, made


class Clauses:
    """Clauses in the order of addition, each terminated by 0."""

    def __init__(self, limit: int) -> None:
        self.variables = 1
        self.count = 0
        self.limit = limit
        self._chunks: list[Literals] = []
        self._append(np.array([TRUE, 0], dtype=np.int32), 1)

    # ------------------------------------------------------------- variables

    def fresh(self, count: int) -> Literals:
        """New variables, (count,)."""
        first = self.variables + 1
        self.variables += count
        return np.arange(first, first + count, dtype=np.int32)

    def reserve(self, count: int) -> None:
        """Check that ``count`` more clauses are within the limit, before they are built.

        Raises:
            TooLarge: the clauses would exceed the limit.
        """
        if self.count + count > self.limit:
            raise TooLarge(self.count + count, self.count)

    # --------------------------------------------------------------- clauses

    def add(self, *columns: Literals | int) -> None:
        """Add one clause for each row of the columns, which broadcast; a column may also be a matrix (rows, literals).

        Raises:
            TooLarge: the clauses would exceed the limit.
        """
        ended = _matrix((*columns, NOTHING))  # the last column is the clause's end
        true = ended == TRUE
        if true.any():
            ended = ended[~true.any(axis=1)]
        self.reserve(len(ended))
        matrix = ended[:, :-1]
        present = (matrix != NOTHING) & (matrix != FALSE)
        if not (present.size and present.all()):
            empty = ~present.any(axis=1)  # the clause is empty: a contradiction
            kept = np.concatenate([present, np.ones((len(matrix), 1), dtype=bool)], axis=1)
            ended, kept = np.insert(ended, 0, FALSE, axis=1), np.insert(kept, 0, empty, axis=1)
            ended = ended[kept]
        self._append(ended.ravel(), len(matrix))

    def add_ragged(self, heads: Literals, bodies: Literals, sizes: Indices) -> None:
        """Add one clause per row of ``heads``, (clauses, heads): these literals, and the next ``sizes`` literals of
        ``bodies``.

        Raises:
            TooLarge: the clauses would exceed the limit.
        """
        count, width = heads.shape
        self.reserve(count)
        ends = np.cumsum(sizes + width + 1)
        flat = np.full(int(ends[-1]) if count else 0, NOTHING, dtype=np.int32)
        starts = ends - (sizes + width + 1)
        for column in range(width):
            flat[starts + column] = heads[:, column]
        owner = np.repeat(np.arange(count), sizes)
        flat[np.arange(len(bodies)) + owner * (width + 1) + width] = bodies
        flat[ends - 1] = _END
        clause = np.repeat(np.arange(count), sizes + width + 1)
        satisfied = np.zeros(count, dtype=bool)
        satisfied[clause[flat == TRUE]] = True
        kept = ~satisfied[clause] & (flat != FALSE) & (flat != NOTHING)
        alone = np.bincount(clause[kept], minlength=count) == 1  # only its end remains: a contradiction
        if np.any(alone & ~satisfied):
            first = starts[alone & ~satisfied]
            flat[first], kept[first] = FALSE, True
        flat[ends - 1] = 0
        self._append(flat[kept], count - int(satisfied.sum()))

    def add_shifted(self, template: Clauses, offset: int) -> None:
        """Add another list's clauses with their variables shifted by ``offset``; the constant variable is not shifted.

        Raises:
            TooLarge: the clauses would exceed the limit.
        """
        self.reserve(template.count)
        for chunk in template._chunks[1:]:
            moved = np.where(np.abs(chunk) > 1, chunk + np.sign(chunk) * np.int32(offset), chunk)
            self._append(moved.astype(np.int32), 0)
        self.count += template.count - 1

    # ----------------------------------------------------------- definitions

    def any_of(self, *columns: Literals | int) -> Literals:
        """For each row, a literal that implies the disjunction of the row: (rows,)."""
        return self._junction(_matrix(columns), TRUE)

    def all_of(self, *columns: Literals | int) -> Literals:
        """For each row, a literal that implies all literals of the row: (rows,)."""
        return self._junction(_matrix(columns), FALSE)

    def _junction(self, matrix: Literals, absorbing: int) -> Literals:
        constant = (matrix == TRUE) | (matrix == FALSE)
        alive = ~constant & (matrix != NOTHING)
        result = np.full(len(matrix), -absorbing, dtype=np.int32)
        if matrix.shape[1]:
            first = matrix[np.arange(len(matrix)), alive.argmax(axis=1)]
            some = alive.any(axis=1)
            result[some] = first[some]
            several = some & (alive & (matrix != first[:, None])).any(axis=1)
            absorbed = (matrix == absorbing).any(axis=1)
            result[absorbed] = absorbing
            rows = np.flatnonzero(several & ~absorbed)
            if rows.size:
                result[rows] = new = self.fresh(rows.size)
                if absorbing == TRUE:
                    self.add(-new, matrix[rows])
                else:
                    row, column = np.nonzero(alive[rows])
                    self.add(-new[row], matrix[rows[row], column])
        return result

    def any_of_ragged(self, literals: Literals, sizes: Indices) -> Literals:
        """For each group of ``sizes`` consecutive literals, a literal that implies their disjunction: (groups,)."""
        return self._ragged(literals, sizes, TRUE)

    def all_of_ragged(self, literals: Literals, sizes: Indices) -> Literals:
        """For each group of ``sizes`` consecutive literals, a literal that implies all of them: (groups,)."""
        return self._ragged(literals, sizes, FALSE)

    def _ragged(self, literals: Literals, sizes: Indices, absorbing: int) -> Literals:
        groups = len(sizes)
        group = np.repeat(np.arange(groups), sizes)
        absorbed = np.zeros(groups, dtype=bool)
        absorbed[group[literals == absorbing]] = True
        alive = (np.abs(literals) > 1) & ~absorbed[group]
        group, literals = group[alive], literals[alive]
        left = np.bincount(group, minlength=groups)
        result = np.full(groups, -absorbing, dtype=np.int32)
        result[absorbed] = absorbing
        result[group[left[group] == 1]] = literals[left[group] == 1]
        several = np.flatnonzero(left > 1)
        if several.size:
            result[several] = new = self.fresh(several.size)
            chosen = left[group] > 1
            if absorbing == TRUE:
                self.add_ragged(-new[:, None], literals[chosen], left[several])
            else:
                self.add(-result[group[chosen]], literals[chosen])
        return result

    def either(self, first: Literals, second: Literals, third: Literals) -> Literals:
        """For each row, a literal that implies ``first``, or both ``second`` and ``third``: (rows,)."""
        joint = np.where(second == TRUE, third, np.where((third == TRUE) | (second == third), second, NOTHING))
        idle = (second == FALSE) | (third == FALSE) | (second == first) | (third == first)
        joint = np.where(idle, FALSE, joint).astype(np.int32)
        alone = (joint == NOTHING) & (first == FALSE)
        joint[alone] = self.all_of(second[alone], third[alone])
        apart = np.flatnonzero((joint == NOTHING) & (first != TRUE))
        result = np.empty_like(joint)
        rest = np.ones(len(joint), dtype=bool)
        rest[apart] = False
        result[rest] = self.any_of(first[rest], joint[rest])
        result[apart] = new = self.fresh(apart.size)
        self.add(-new, first[apart], second[apart])
        self.add(-new, first[apart], third[apart])
        return result

    def at_least(self, count: int, matrix: Literals) -> Literals:
        """For each row, a literal that implies at least ``count`` literals of the row: (rows,).

        Source:
            Sinz, "Towards an optimal CNF encoding of Boolean cardinality constraints", 2005.
        """
        rows, width = matrix.shape
        if count <= 0 or count > width:
            return np.full(rows, TRUE if count <= 0 else FALSE, dtype=np.int32)
        if count == 1:
            return self.any_of(matrix)
        if count == width:
            return self.all_of(matrix)
        so_far = [np.full(rows, TRUE if number == 0 else FALSE, dtype=np.int32) for number in range(count + 1)]
        for column in range(width):
            for number in range(min(count, column + 1), max(0, count - width + column), -1):
                so_far[number] = self.either(so_far[number], matrix[:, column], so_far[number - 1])
        return so_far[count]

    # --------------------------------------------------------------- reading

    def since(self, position: int) -> tuple[Literals, int]:
        """Literals added since ``position`` (at first 0), with a 0 after each clause; and the next position."""
        new = self._chunks[position:]
        return (np.concatenate(new) if new else np.zeros(0, dtype=np.int32)), len(self._chunks)

    def everything(self) -> Literals:
        """Literals of all clauses, with a 0 after each clause."""
        return np.concatenate(self._chunks)

    def _append(self, flat: Literals, count: int) -> None:
        if flat.size:
            self._chunks.append(np.ascontiguousarray(flat, dtype=np.int32))
        self.count += count


def _matrix(columns: tuple[Literals | int, ...]) -> Literals:
    """Columns, (rows,), (rows, literals) or one number each, side by side: (rows, literals)."""
    if len(columns) == 1 and isinstance(columns[0], np.ndarray) and columns[0].ndim == 2:
        return columns[0]
    rows = max((len(column) for column in columns if isinstance(column, np.ndarray)), default=1)
    widths = [column.shape[1] if isinstance(column, np.ndarray) and column.ndim == 2 else 1 for column in columns]
    matrix = np.empty((rows, sum(widths)), dtype=np.int32)
    start = 0
    for column, width in zip(columns, widths, strict=True):
        block = column[:, None] if isinstance(column, np.ndarray) and column.ndim == 1 else column
        matrix[:, start : start + width] = block
        start += width
    return matrix


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
