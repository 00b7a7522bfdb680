"""Rows of a mixed-integer program for a formula tree of stlpy, with few binaries.

Each branch of an ``or`` has a binary variable, an ``and`` passes its own on, and a predicate is one row with the
smallest sufficient constant.

Source:
    V. Kurtz and H. Lin, Mixed-integer programming for STL with fewer binary variables.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import LinearConstraint
from scipy.sparse import coo_array

from table1.specification import Stl

Terms = list[tuple[int, float]]
"""Columns with their weights."""


class FormulaRows:
    """Rows, each the least value of a weighted sum of columns; ``columns`` counts the columns so far."""

    columns: int

    def __init__(self) -> None:
        self.terms: list[tuple[int, int, float]] = []
        self.least: list[float] = []

    def predicate(self, node: Stl, step: int) -> tuple[Terms, float]:
        """Terms of a predicate at a step, at least ``node.b``, and a lower bound of their sum."""
        raise NotImplementedError

    def row(self, terms: Terms, least: float) -> None:
        self.terms.extend((len(self.least), column, weight) for column, weight in terms)
        self.least.append(least)

    def within(self, terms: Terms, most: float) -> None:
        """Two rows: the absolute value of a sum is at most ``most``."""
        self.row(terms, -most)
        self.row([(column, -weight) for column, weight in terms], -most)

    def formula(self, node: Stl, step: int, switch: int | None) -> None:
        """Add rows so that ``node`` holds at ``step`` if the binary ``switch`` is 1, or always without one."""
        if node.is_predicate():
            (terms, lowest), bound = self.predicate(node, step), float(node.b[0])
            if switch is not None:
                slack = bound - lowest
                terms, bound = [*terms, (switch, -slack)], bound - slack
            self.row(terms, bound)
        elif node.combination_type == "and":
            for part, ahead in zip(node.subformula_list, node.timesteps, strict=True):
                self.formula(part, step + ahead, switch)
        else:
            switches = [self.columns + number for number in range(len(node.subformula_list))]
            self.columns += len(switches)
            # A sum of binaries, at least 1, or at least the enclosing binary.
            above = [] if switch is None else [(switch, -1.0)]
            self.row([(each, 1.0) for each in switches] + above, 1.0 if switch is None else 0.0)
            for part, ahead, each in zip(node.subformula_list, node.timesteps, switches, strict=True):
                self.formula(part, step + ahead, each)

    def constraints(self) -> LinearConstraint:
        """All rows as a constraint of scipy."""
        row, column, weight = (np.array(each) for each in zip(*self.terms, strict=True))
        matrix = coo_array((weight, (row, column)), shape=(len(self.least), self.columns)).tocsr()
        return LinearConstraint(matrix, np.array(self.least), np.inf)
