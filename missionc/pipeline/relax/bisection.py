"""Bisection over changes of one kind: the first ones until one makes it feasible, then ever smaller ones."""

from __future__ import annotations

from dataclasses import dataclass

from missionc.pipeline.relax.knobs import Knob


@dataclass(slots=True)
class Trying:
    """What is known of one knob: the smallest change that does, and the largest one below it that does not.

    Changes of one kind are taken to do where a smaller one does; none is believed before it has been tried.
    """

    knob: Knob
    best: int | None = None
    refused: int = 0
    tries: int = 0
    proven: bool = True
    """The largest one that does not was refused, rather than left undecided; no change at all was refused."""

    def next(self) -> int | None:
        """How many notches to try; None where nothing is left to learn."""
        if self.best is not None:
            return (self.refused + self.best) // 2 if self.best - self.refused > 1 else None
        if self.refused >= self.knob.most:
            return None
        return min(self.knob.most, max(self.knob.first, 2 * self.refused))

    def learn(self, notches: int, *, does: bool, proven: bool) -> None:
        self.tries += 1
        if does:
            self.best = notches
        else:
            self.refused, self.proven = notches, proven

    @property
    def smallest(self) -> bool:
        """Whether the next smaller change was refused."""
        return self.best is not None and self.best - self.refused == 1 and self.proven
