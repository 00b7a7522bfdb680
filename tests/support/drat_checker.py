"""A checker of DRAT proofs: slow, simple, and independent of ``missionc``.

It goes through the proof from the beginning. A clause may be added if its negation leads to a contradiction by unit
propagation alone (RUP), or if that is so of its resolvents upon its first literal (RAT). Like other checkers it keeps a
literal that was once found true, even if the clause that says so is dropped.

Source:
    Wetzler, Heule and Hunt, "DRAT-trim: Efficient checking and trimming using expressive clausal proofs", 2014.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

Clause = frozenset[int]


@dataclass(slots=True)
class Database:
    """Clauses so far, with the literals that follow by unit propagation."""

    count: Counter[Clause] = field(default_factory=Counter)
    of: defaultdict[int, set[Clause]] = field(default_factory=lambda: defaultdict(set))
    fixed: set[int] = field(default_factory=set)
    refuted: bool = False

    def add(self, clause: Clause) -> None:
        self.count[clause] += 1
        for literal in clause:
            self.of[literal].add(clause)
        unassigned = [literal for literal in clause if -literal not in self.fixed]
        if not unassigned:
            self.refuted = True
        elif len(unassigned) == 1:
            self.refuted |= self.conflict(unassigned, self.fixed)

    def drop(self, clause: Clause) -> None:
        self.count[clause] -= 1
        if not self.count[clause]:
            for literal in clause:
                self.of[literal].discard(clause)

    def conflict(self, assumed: Iterable[int], true: set[int]) -> bool:
        """Add assumptions and their consequences to ``true``; returns whether they are contradictory."""
        todo = list(assumed)
        while todo:
            literal = todo.pop()
            if -literal in true:
                return True
            if literal in true:
                continue
            true.add(literal)
            for clause in self.of[-literal]:
                if true.isdisjoint(clause):
                    unassigned = [each for each in clause if -each not in true]
                    if not unassigned:
                        return True
                    if len(unassigned) == 1:
                        todo.append(unassigned[0])
        return False

    def implies(self, clause: Iterable[int]) -> bool:
        return self.conflict([-literal for literal in clause], set(self.fixed))

    def may_add(self, lemma: list[int]) -> bool:
        if self.refuted or self.implies(lemma):
            return True
        if not lemma or -lemma[0] in self.fixed:
            return False
        return all(self.implies({*lemma, *(clause - {-lemma[0]})}) for clause in self.of[-lemma[0]])


def fault(cnf: str, drat: str) -> str:
    """Error in the proof that the clauses are unsatisfiable; empty if it is correct."""
    found, database = clauses_of(cnf), Database()
    variables, clauses = map(int, cnf.split("\n", 1)[0].removeprefix("p cnf ").split())
    if len(found) != clauses or any(abs(literal) > variables for clause in found for literal in clause):
        return "the header promises other clauses"
    for clause in found:
        database.add(frozenset(clause))
    for number, line in enumerate(drat.splitlines(), 1):
        *words, end = line.removeprefix("d ").split()
        lemma = [int(word) for word in words]
        if end != "0":
            return f"line {number} has no end"
        if line.startswith("d "):
            database.drop(frozenset(lemma))
        elif not database.may_add(lemma):
            return f"line {number} does not follow"
        elif not lemma:
            return ""
        else:
            database.add(frozenset(lemma))
    return "the proof never comes to the empty clause"


def clauses_of(cnf: str) -> list[list[int]]:
    """Clauses of a DIMACS text."""
    found: list[list[int]] = [[]]
    for word in cnf.split("\n", 1)[1].split():
        if word == "0":
            found.append([])
        else:
            found[-1].append(int(word))
    return found[:-1]
