"""Planner options of a compilation: flag, values, help and manifest rule of each.

An option is a field of ``Options`` and an entry of ``DESCRIBED``. The command line, the manifest and its verification
use these.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Final, TypeAlias

from missionc.base.late_dataclass import Record

SOLVERS = ("auto", "z3", "cadical", "race")
"""Solvers of the smt backend; the first is the default."""

SLOWEST = 1000
"""Greatest ratio of a flight's duration to the planned one."""


OWN_PRESETS = ("sketch", "search")
"""Presets that are not the method of a paper."""

TRANSPORT_PRESETS = (*OWN_PRESETS, "paper", "fsot", "mpot")
"""Presets of the transport backend; the first is the default."""

ROADMAP_PRESETS = ("paper", "paper-apart")
"""Presets of the roadmap backend; its own method has no name."""

PRESETS = tuple(dict.fromkeys((*TRANSPORT_PRESETS, *ROADMAP_PRESETS)))


DEVICES = ("cpu", "cuda")
"""Devices for batches of trajectories; the first is the default."""


class Options(Record):
    """Options that change the result of a compilation, most of them for one backend."""

    solver: str = SOLVERS[0]
    require_solver: bool = False
    """The smt backend asks a solver about all agents in one question, without searches of its own."""
    certify: bool = False
    captures: frozenset[str] = frozenset()
    """Texts to keep in ``Report.texts``: ``dimacs``, ``smt2``."""
    preset: str = PRESETS[0]
    samples: int | None = None
    """Number of trajectories that presets with a local search optimise together; None means the preset's own."""
    device: str = DEVICES[0]
    margin: float | None = None
    """Metres by which requirements should hold if possible; None means the vehicles' own."""
    processes: int = 1
    """Number of child processes for parallel work, at least 1; the plan is the same."""
    stretch: float = 1.0
    """Ratio of a flight's duration to the planned one; backends do not see it."""
    brief: bool = False
    """Short search: the smt backend tries only its first roadmap, and does not minimise conflicts."""


class Recorded(Enum):
    """Condition for an option's value in the manifest."""

    ALWAYS = auto()
    BY_ITS_BACKENDS = auto()
    WHERE_GIVEN = auto()
    NEVER = auto()


class OneOf(Record):
    """Choice from some words; the first is the default."""

    words: tuple[str, ...]

    def admits(self, text: str) -> bool:
        """Return whether a manifest may contain the text."""
        return text in self.words


class Whole(Record):
    """An integer within a range, both ends included."""

    least: int
    most: int

    def admits(self, text: str) -> bool:
        """Return whether a manifest may contain the text: digits in Python's format."""
        return text.isascii() and text.isdigit() and len(text) <= len(str(self.most)) and self._has(int(text))

    def _has(self, number: int) -> bool:
        return self.least <= number <= self.most


class Real(Record):
    """A finite number within a range, both ends included."""

    least: float
    most: float

    def admits(self, text: str) -> bool:
        """Return whether a manifest may contain the text: a number in Python's format."""
        try:
            number = float(text)
        except ValueError:
            return False
        return math.isfinite(number) and self.least <= number <= self.most and repr(number) == text


class Switch(Record):
    """A flag that is given or not."""

    def admits(self, text: str) -> bool:
        """Return whether a manifest may contain the text for a given flag."""
        return text == repr(True)


Kind: TypeAlias = OneOf | Whole | Real | Switch


class Described(Record):
    """Complete description of one option.

    Args:
        name: field of ``Options``; its flag is ``--name``, with ``-`` for ``_``.
        metavar: placeholder for its value in the help; empty for the words themselves.
        help: its line in the help of ``missionc compile``.
        recorded: when the manifest contains it.
        refused: True if a backend without this option rejects it instead of ignoring it.
    """

    name: str
    kind: Kind
    metavar: str = ""
    help: str = ""
    recorded: Recorded = Recorded.NEVER
    refused: bool = False

    @property
    def default(self) -> object:
        return getattr(Options(), self.name)

    @property
    def flag(self) -> str:
        return f"--{self.name.replace('_', '-')}"

    def words(self, options: Options) -> list[str]:
        """Flag on a command line, with its value if it takes one."""
        return [self.flag] if isinstance(self.kind, Switch) else [self.flag, self.text(options)]

    def text(self, options: Options) -> str:
        """Value for a manifest: words as they are, numbers in Python's format."""
        value = getattr(options, self.name)
        return value if isinstance(value, str) else repr(value)


DESCRIBED: Final = {
    each.name: each
    for each in (
        Described("solver", OneOf(SOLVERS), help="SAT solver of the backend smt.", recorded=Recorded.ALWAYS),
        Described(
            "require_solver",
            Switch(),
            help="Plan all agents in one SAT problem, without prioritized planning.",
            recorded=Recorded.WHERE_GIVEN,
            refused=True,
        ),
        Described(
            "preset",
            OneOf(PRESETS),
            help="Planning method of the backend clot. The backend smt has only the presets `paper` and `paper-apart`.",
            recorded=Recorded.BY_ITS_BACKENDS,
            refused=True,
        ),
        Described(
            "device",
            OneOf(DEVICES),
            help="Device for trajectory optimization in all presets except `sketch`.",
            recorded=Recorded.BY_ITS_BACKENDS,
            refused=True,
        ),
        Described(
            "samples",
            Whole(1, 100_000),
            "N",
            "Number of trajectories that are optimized together in all presets except `sketch`.",
            Recorded.WHERE_GIVEN,
        ),
        Described(
            "margin",
            Real(0, 1e3),
            "METRES",
            "Robustness margin that the plan should reach. [default: tracking margin of the vehicles]",
            Recorded.WHERE_GIVEN,
        ),
        Described(
            "processes",
            Whole(1, 256),
            "N",
            "Number of child processes of the backends clot and hybrid. The plan does not depend on this number.",
            refused=True,
        ),
        Described(
            "stretch",
            Real(1, SLOWEST),
            "S",
            "Scale the duration of the plan by S, so that agents move S times slower.",
            Recorded.WHERE_GIVEN,
        ),
        Described("certify", Switch(), help="Write a proof if no plan exists. `missionc verify` checks the proof."),
    )
}
"""Every option with a flag, in the order of the manifest."""
