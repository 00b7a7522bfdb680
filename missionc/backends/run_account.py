"""Account of a search: seconds by stage, sizes and notes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from missionc.backends.api import CutShort, Report
from missionc.base.signals import stop_requested
from missionc.base.solved import Solved
from missionc.base.units import Seconds


@dataclass(slots=True)
class Account:
    seconds: dict[str, float] = field(default_factory=dict)
    sizes: dict[str, int] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    cut_short: CutShort | None = None
    work: float = 0.0
    """Work done, in units of ``work``."""
    solved: tuple[Solved, ...] = ()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Context whose duration is added to the seconds of the stage ``name``, also after an exception."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - begin

    def cut(self) -> None:
        """Record that the best plan so far is returned because the time limit was reached or a signal arrived."""
        self.cut_short = CutShort.SIGNAL if stop_requested() else CutShort.TIME
        self.notes.append(self.cut_short.note)

    def add(self, other: Account) -> None:
        """Add another account: seconds, work and iterations are summed, other sizes are replaced."""
        for stage, spent in other.seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + spent
        iterations = self.sizes.get("iterations", 0) + other.sizes.get("iterations", 0)
        self.sizes |= other.sizes | {"iterations": iterations}
        self.notes.extend(other.notes)
        self.work += other.work

    def spend(self, report: Report) -> None:
        """Add the seconds and the work of another search's report, without its notes."""
        for stage, spent in report.seconds:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + spent
        self.work += report.work

    def report(self) -> Report:
        return Report(
            seconds=tuple((stage, Seconds(spent)) for stage, spent in self.seconds.items()),
            sizes=tuple(self.sizes.items()),
            texts=tuple(self.texts.items()),
            files=tuple(self.files.items()),
            notes=tuple(self.notes),
            cut_short=self.cut_short,
            work=self.work,
            solved=self.solved,
        )
