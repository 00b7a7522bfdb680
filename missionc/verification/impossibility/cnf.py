"""Clauses of a refutation: a plain list, with one literal for each formula, which implies the formula.

Source:
    Plaisted and Greenbaum, "A structure-preserving clause form translation", 1986.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

TRUE, FALSE = 1, -1

MOST_CLAUSES = 8_000_000
"""Maximum number of clauses of a checked proof."""


class TooManyClauses(ValueError):
    """Error: the refutation has more clauses than the limit."""


class Cnf:
    """Clauses in conjunctive normal form; variable 1 is true, and constant literals are folded.

    Raises:
        TooManyClauses: raised by every addition beyond the limit.
    """

    def __init__(self) -> None:
        self.variables = 1
        self.clauses: list[list[int]] = [[TRUE]]

    def fresh(self) -> int:
        self.variables += 1
        return self.variables

    def add(self, literals: Iterable[int]) -> None:
        """Add a clause: at least one of these literals is true."""
        clause = [literal for literal in literals if literal != FALSE]
        if TRUE not in clause:
            self._keep(clause or [FALSE])

    def _keep(self, clause: list[int]) -> None:
        if len(self.clauses) >= MOST_CLAUSES:
            raise TooManyClauses(f"there are more than {MOST_CLAUSES} clauses")
        self.clauses.append(clause)

    def all_of(self, literals: Iterable[int]) -> int:
        """A literal that implies all of the given literals."""
        parts = dict.fromkeys(literal for literal in literals if literal != TRUE)
        if FALSE in parts:
            return FALSE
        if len(parts) < 2:
            return next(iter(parts), TRUE)
        name = self.fresh()
        for literal in parts:
            self._keep([-name, literal])
        return name

    def any_of(self, literals: Iterable[int]) -> int:
        """A literal that implies at least one of the given literals."""
        parts = dict.fromkeys(literal for literal in literals if literal != FALSE)
        if TRUE in parts:
            return TRUE
        if len(parts) < 2:
            return next(iter(parts), FALSE)
        name = self.fresh()
        self._keep([-name, *parts])
        return name

    def at_least(self, count: int, literals: Sequence[int]) -> int:
        """A literal that implies that at least ``count`` of the given literals are true.

        Source:
            Sinz, "Towards an optimal CNF encoding of Boolean cardinality constraints", 2005.
        """
        if count <= 0:
            return TRUE
        before = [TRUE] + [FALSE] * count
        for literal in literals:
            row = [TRUE]
            for number in range(1, count + 1):
                with_it = self.all_of((literal, before[number - 1]))
                row.append(self.any_of((before[number], with_it)))
            before = row
        return before[count]

    def at_most_one(self, literals: Sequence[int]) -> None:
        """Add clauses that make at most one of these literals true."""
        parts = [literal for literal in literals if literal != FALSE]
        seen = FALSE
        for literal in parts:
            self.add((-seen, -literal))
            after = self.fresh()
            self.add((-seen, after))
            self.add((-literal, after))
            seen = after

    def dimacs(self) -> bytes:
        """The clauses as the content of a DIMACS file."""
        lines = [f"p cnf {self.variables} {len(self.clauses)}"]
        lines.extend(" ".join(map(str, clause)) + " 0" for clause in self.clauses)
        return ("\n".join(lines) + "\n").encode()
