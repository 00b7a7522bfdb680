"""Planner options of a compilation: flag, allowed values, help text and manifest rule of each option.

An option is a field of ``Options`` and an entry of ``DESCRIBED``. The command line, the manifest and its verification
use these entries.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Final, TypeAlias

from missionc.base.late_dataclass import Record

SOLVERS = ("auto", "z3", "cadical", "race")
"""Values of the option for the SAT solver of the smt backend; the first is the default."""

SLOWEST = 1000
"""Largest allowed ratio of a flight's duration to the planned duration."""


OWN_PRESETS = ("sketch", "search")
"""Presets that are not methods of a paper."""

TRANSPORT_PRESETS = (*OWN_PRESETS, "paper", "fsot", "mpot")
"""Presets of the clot backend; the first is the default."""

ROADMAP_PRESETS = ("paper", "paper-apart")
"""Presets of the smt backend; its default method has no preset name."""

PRESETS = tuple(dict.fromkeys((*TRANSPORT_PRESETS, *ROADMAP_PRESETS)))


DEVICES = ("cpu", "cuda")
"""Devices for batched trajectory optimisation; the first is the default."""


class Options(Record):
    """Options that change the result of a compilation; most affect one backend only."""

    solver: str = SOLVERS[0]
    require_solver: bool = False
    """True to let the smt backend decide all agents in one SAT query, without its own searches."""
    certify: bool = False
    captures: frozenset[str] = frozenset()
    """Names of the solver inputs that ``Report.texts`` must contain: ``dimacs``, ``smt2``."""
    preset: str = PRESETS[0]
    samples: int | None = None
    """Number of trajectories that presets with a local search optimise together; None means the preset's default."""
    device: str = DEVICES[0]
    margin: float | None = None
    """Margin, metres, with which to satisfy requirements if possible; None means the vehicles' tracking errors."""
    processes: int = 1
    """Number of child processes for parallel work, at least 1; the plan does not depend on it."""
    stretch: float = 1.0
    """Ratio of a flight's duration to the planned duration; backends do not read it."""
    brief: bool = False
    """True for a short search: the smt backend tries only its first roadmap, and does not minimise conflicts."""


class Recorded(Enum):
    """Condition under which the manifest contains the value of an option."""

    ALWAYS = auto()
    BY_ITS_BACKENDS = auto()
    WHERE_GIVEN = auto()
    NEVER = auto()


class OneOf(Record):
    """Option type: one of some words; the first is the default."""

    words: tuple[str, ...]

    def admits(self, text: str) -> bool:
        """Return true if a manifest may contain the text as a value of this type."""
        return text in self.words


class Whole(Record):
    """Option type: an integer within a range, both ends included."""

    least: int
    most: int

    def admits(self, text: str) -> bool:
        """Return true if a manifest may contain the text as a value of this type: an integer as Python prints it."""
        return text.isascii() and text.isdigit() and len(text) <= len(str(self.most)) and self._has(int(text))

    def _has(self, number: int) -> bool:
        return self.least <= number <= self.most


class Real(Record):
    """Option type: a finite number within a range, both ends included."""

    least: float
    most: float

    def admits(self, text: str) -> bool:
        """Return true if a manifest may contain the text as a value of this type: a number as Python prints it."""
        try:
            number = float(text)
        except ValueError:
            return False
        return math.isfinite(number) and self.least <= number <= self.most and repr(number) == text


class Switch(Record):
    """Option type: a flag without a value."""

    def admits(self, text: str) -> bool:
        """Return true if a manifest may contain the text as a value of this type: ``True``."""
        return text == repr(True)


Kind: TypeAlias = OneOf | Whole | Real | Switch


class Described(Record):
    """Description of one option.

    Args:
        name: field of ``Options``; its flag is ``--name``, with ``-`` for ``_``.
        metavar: placeholder for its value in the help; empty to list the allowed words.
        help: its line in the help of ``missionc compile``.
        recorded: condition under which the manifest contains its value.
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
        """Command-line words that set the option: the flag, and its value if it takes one."""
        return [self.flag] if isinstance(self.kind, Switch) else [self.flag, self.text(options)]

    def text(self, options: Options) -> str:
        """Value of the option in a manifest: words unchanged, numbers as Python prints them."""
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
"""Descriptions of all options that have a flag, in the order of the manifest."""
