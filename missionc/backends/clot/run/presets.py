"""Presets: named planning methods that each omit or restore a part, for comparisons.

    sketch   schedule, key frames, one joint sketch, joint polish; every eighth attempt is a ``search``. The default.
    search   Algorithm 2 over Algorithm 1, seeded with the sketch and its schedule; joint polish at the end.
    paper    Algorithm 2 over Algorithm 1 as published: the four rules, exact Sinkhorn, motions from the prior, (9) and
             the sequences as printed, no polish.
    fsot     one fixed sequence, breadth first, one motion for each agent, without backtracking.
    mpot     no sequence: the waypoints of all agents are transported together.

``fsot`` and ``mpot`` lack the interpretations of ``paper``: samples around a neighbour, ``until`` as a disjunction, a
smaller weight of goals that later agents may satisfy.

``paper`` keeps some of our parts: positions for states, a rotation for each waypoint, steps smoothed over time (without
that almost nothing is found, see ``transport``), scores normalised by visits, and start and finish regions from a key
frame, which the paper does not have.

The paper optimises 800 to 1000 trajectories at once on a GPU; ``samples`` is the number here. By default (without
``--samples``), it is 96 on a CPU, and the paper's 800 on a GPU. ``paper`` divides them among the nodes of a round, so
that fewer nodes have more trajectories each.

Source:
    [clot] Algorithms 1 and 2; V-A.3 (I) and (II) for ``mpot`` and ``fsot``.
"""

from __future__ import annotations

from dataclasses import field, replace
from enum import Enum, auto

from missionc.backends.clot.settings import ClotSettings, Coupling, SearchSettings, TransportSettings, clot_settings
from missionc.backends.clot.spec import CLOT
from missionc.backends.options import Options
from missionc.backends.setting import own_values, with_values
from missionc.base.late_dataclass import Record
from missionc.ir import Mission


class SequenceChoice(Enum):
    """Order of planning of the agents."""

    TOGETHER = auto()
    """No order: all at once."""
    FIXED = auto()
    """One sequence, breadth first."""
    SEARCHED = auto()
    """Every valid sequence may be tried."""


class Preset(Record):
    """Method of making candidates.

    Args:
        local: True if Algorithm 1 is used.
        seeded: True if candidates begin at the sketch, pass the key frames, and follow the schedule's choices.
        polished: True if results are polished jointly.
        slack: violation allowed for a partial team before polish, metres.
        deviation: deviation of the prior half-way between two ends, for a world 10 m wide, metres.
        settled: True if an expansion ends once enough candidates are feasible with a margin.
        reward: weight of a metre of the goals' mean robustness against a metre of a goal's shortfall.
        published: number of trajectories in the paper's GPU batches; 0 if it has no such preset.
    """

    name: str
    local: bool = True
    order: SequenceChoice = SequenceChoice.SEARCHED
    seeded: bool = False
    polished: bool = False
    slack: float = 0.0
    deviation: float = 1.5
    settled: bool = False
    reward: float = 0.0
    published: int = 0
    search: SearchSettings = field(default_factory=SearchSettings)
    transport: TransportSettings = field(default_factory=TransportSettings)

    def tuned(self, mission: Mission) -> Preset:
        """The preset with a mission's values for search and transport."""
        values = {
            name: each for name, each in own_values(mission, CLOT.name) if name.startswith(("search.", "transport."))
        }
        own = with_values(ClotSettings(search=self.search, transport=self.transport), values)
        return replace(self, search=own.search, transport=own.transport)

    def with_samples(self, samples: int | None, device: str = "cpu") -> Preset:
        """The preset with ``samples`` trajectories; by default on a GPU, as many as published."""
        if samples is None and device != "cpu":
            samples = self.published or None
        if samples is None:
            return self
        few = max(1, samples * self.search.narrow // self.search.wide) if self.search.printed else samples
        return replace(self, search=replace(self.search, few_samples=few, many_samples=samples))


PAPER = SearchSettings(few_samples=200, many_samples=800, children=800, printed=True, eta=0.01)
"""Number of trajectories of scenarios 1 and 2, divided among the nodes of a round; scenario 3 uses 1000.

Source:
    [clot] V-A.1.
"""

FSOT = SearchSettings(wide=1, narrow=1, children=1, tries=1)
"""One motion for each agent without backtracking; with ``planning_sequence.in_order``, the ablation with a fixed
sequence.

Source:
    [clot] V-A.3, baseline (II).
"""

_PUBLISHED = TransportSettings(iterations=40, coupling=Coupling.SINKHORN)

_PAPER = Preset(
    "paper",
    reward=0.5,
    published=PAPER.many_samples,
    search=replace(PAPER, few_samples=24, many_samples=96),
    transport=_PUBLISHED,
)

PRESETS = {
    each.name: each
    for each in (
        Preset("sketch", local=False, seeded=True, polished=True),
        Preset(
            "search",
            seeded=True,
            polished=True,
            slack=0.1,
            deviation=0.6,
            settled=True,
            search=SearchSettings(wide=2, children=3, few_samples=32, many_samples=32, expansions=6),
            transport=TransportSettings(iterations=20, first_radius=0.5),
        ),
        _PAPER,
        replace(_PAPER, name="fsot", order=SequenceChoice.FIXED, search=replace(FSOT, few_samples=96, many_samples=96)),
        replace(
            _PAPER, name="mpot", order=SequenceChoice.TOGETHER, search=SearchSettings(few_samples=96, many_samples=96)
        ),
    )
}


def preset(name: str, samples: int | None = None, device: str = "cpu") -> Preset:
    """Preset of that name, with the given number of trajectories, or the device's default.

    Raises:
        ValueError: the preset is unknown, or the number is less than 1.
    """
    if name not in PRESETS:
        raise ValueError(f"unknown preset `{name}`; use one of {', '.join(PRESETS)}")
    if samples is not None and samples < 1:
        raise ValueError(f"many_samples = {samples} is below 1")
    return PRESETS[name].with_samples(samples, device)


def fewer_samples(way: Preset, samples: int | None, device: str) -> str | None:
    """Note if a preset uses fewer trajectories than the paper because no GPU was selected."""
    if samples is not None or device != "cpu" or not way.published:
        return None
    return (
        f"preset `{way.name}` optimized {way.search.many_samples} trajectories together; the paper uses {way.published}"
        " on a GPU: `--device cuda` uses as many, and `--samples` sets the number"
    )


def tuned_settings(mission: Mission, options: Options) -> ClotSettings:
    """All settings of a mission; search and transport from the preset, with ``search`` for ``sketch``."""
    name = options.preset if options.preset in PRESETS and PRESETS[options.preset].local else "search"
    searching = preset(name, options.samples, options.device).tuned(mission)
    return replace(clot_settings(mission), search=searching.search, transport=searching.transport)
