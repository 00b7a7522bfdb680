"""Planner options of a compilation: for each its flag, its values, its help, and when the manifest records it.

An option is a field of ``Options`` and an entry of ``DESCRIBED``; the command
line, the manifest and its verification are made of these.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Final, TypeAlias

from missionc.base.late_dataclass import dataclass

SOLVERS = ("auto", "z3", "cadical", "race")
"""What answers the smt backend's questions; the first is the default."""

SLOWEST = 1000
"""How many times as long as planned a flight may take at most."""


OWN_PRESETS = ("sketch", "search")
"""Presets that are not the method of a paper."""

TRANSPORT_PRESETS = (*OWN_PRESETS, "paper", "fsot", "mpot")
"""Ways to plan that the transport backend knows by name; the first is the default."""

ROADMAP_PRESETS = ("paper", "paper-apart")
"""Those that the roadmap backend knows by name; it has no name for its own."""

PRESETS = tuple(dict.fromkeys((*TRANSPORT_PRESETS, *ROADMAP_PRESETS)))


DEVICES = ("cpu", "cuda")
"""Where batches of trajectories may be worked on; the first is the default."""


@dataclass(frozen=True, slots=True)
class Options:
    """Choices of the command line that change what becomes of a mission, most of them of one backend."""

    solver: str = SOLVERS[0]
    require_solver: bool = False
    """The smt backend asks a solver for all agents together, in one question, and searches for none by itself."""
    certify: bool = False
    captures: frozenset[str] = frozenset()
    """Texts to keep in ``Report.texts``: ``dimacs``, ``smt2``."""
    preset: str = PRESETS[0]
    samples: int | None = None
    """Trajectories that presets with a local search optimise at once; None leaves it to the preset."""
    device: str = DEVICES[0]
    margin: float | None = None
    """Metres by which requirements are to hold where that is possible; None leaves it to the mission's vehicles."""
    processes: int = 1
    """Child processes for what can be done at once, at least 1; the plan is the same."""
    stretch: float = 1.0
    """How many times as long as planned a flight takes; no backend hears of it."""
    brief: bool = False
    """Asked by the way: the smt backend tries its first roadmap alone, and looks for no smaller conflict."""


class Recorded(Enum):
    """When an option's value is written into the manifest."""

    ALWAYS = auto()
    BY_ITS_BACKENDS = auto()
    WHERE_GIVEN = auto()
    NEVER = auto()


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of some words; the first is the default."""

    words: tuple[str, ...]

    def admits(self, text: str) -> bool:
        """Whether a manifest may say so."""
        return text in self.words


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number, both ends included."""

    least: int
    most: int

    def admits(self, text: str) -> bool:
        """Whether a manifest may say so: digits as Python writes them."""
        return text.isascii() and text.isdigit() and len(text) <= len(str(self.most)) and self._has(int(text))

    def _has(self, number: int) -> bool:
        return self.least <= number <= self.most


@dataclass(frozen=True, slots=True)
class Real:
    """A finite number, both ends included."""

    least: float
    most: float

    def admits(self, text: str) -> bool:
        """Whether a manifest may say so: a number as Python writes it."""
        try:
            number = float(text)
        except ValueError:
            return False
        return math.isfinite(number) and self.least <= number <= self.most and repr(number) == text


@dataclass(frozen=True, slots=True)
class Switch:
    """Given or not."""

    def admits(self, text: str) -> bool:
        """Whether a manifest may say so: that it was given."""
        return text == repr(True)


Kind: TypeAlias = OneOf | Whole | Real | Switch


@dataclass(frozen=True, slots=True)
class Described:
    """One option, in all that is to be said of it.

    Args:
        name: the field of ``Options``; its flag is ``--name``, with ``-`` for ``_``.
        metavar: the word for its value in the help; empty for the words themselves.
        help: its line in the help of ``missionc compile``.
        recorded: when the manifest says it.
        refused: whether a backend that does not hear of it refuses it, and does not pass it over.
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
        """The flag on a command line, and its value if it takes one."""
        return [self.flag] if isinstance(self.kind, Switch) else [self.flag, self.text(options)]

    def text(self, options: Options) -> str:
        """The value as a manifest has it: words as they are, numbers as Python writes them."""
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
            help="Planning method of clot. The backend smt has `paper` and `paper-apart` only.",
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
            "Number of trajectories optimized together, in all presets except `sketch`.",
            Recorded.WHERE_GIVEN,
        ),
        Described(
            "margin",
            Real(0, 1e3),
            "METRES",
            "Robustness margin to plan for. [default: tracking margin of the vehicles]",
            Recorded.WHERE_GIVEN,
        ),
        Described(
            "processes",
            Whole(1, 256),
            "N",
            "Number of child processes of clot and hybrid. It does not change the plan.",
            refused=True,
        ),
        Described(
            "stretch",
            Real(1, SLOWEST),
            "S",
            "Scale the time of the plan by S, so that agents move S times slower.",
            Recorded.WHERE_GIVEN,
        ),
        Described("certify", Switch(), help="Write a proof if no plan exists. `missionc verify` checks it."),
    )
}
"""Every option that has a flag, in the order in which a manifest has them."""
