"""Deletion with clause-set refinement: from a set that cannot hold to a smallest one, question by question.

Source:
    Marques-Silva and Lynce, "On improving MUS extraction algorithms", SAT 2011.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field


@dataclass(slots=True)
class Deletion:
    """A conflict as it gets smaller; all its names together cannot hold.

    What holds without a name holds without it however small the conflict gets, so that no question is put twice.
    """

    conflict: tuple[str, ...]
    needed: set[str] = field(default_factory=set)
    """Names without which the others can hold."""
    left_open: set[str] = field(default_factory=set)
    """Names of which it was not found out, in the conflict as it was then."""

    @property
    def smallest(self) -> bool:
        """Every proper subset can hold."""
        return self.needed.issuperset(self.conflict)

    def question(self) -> str | None:
        """A name without which the others may hold or not; None where nothing is left to ask."""
        return next((name for name in self.conflict if name not in self.needed | self.left_open), None)

    def without(self, name: str) -> tuple[str, ...]:
        return tuple(other for other in self.conflict if other != name)

    def holds(self, without: str) -> None:
        """The others can hold."""
        self.needed.add(without)

    def refused(self, core: Collection[str]) -> None:
        """These names of the conflict cannot hold together; what was left open of a larger one is asked again."""
        self.conflict = tuple(name for name in self.conflict if name in core)
        self.left_open.clear()

    def unknown(self, without: str) -> None:
        """Whether the others can hold was not found out."""
        self.left_open.add(without)
