"""Presets: named ways to plan, each of which leaves something out or puts something back, so that parts compare.

    sketch   schedule, key frames, one joint sketch, joint polish; every eighth attempt is a ``search``. The default.
    search   Algorithm 2 over Algorithm 1, seeded with the sketch and its schedule; joint polish at the end.
    paper    Algorithm 2 over Algorithm 1 as published: the four rules, exact Sinkhorn, motions from the prior, (9) and
             the sequences as printed, no polish.
    fsot     one fixed sequence, breadth first, one motion for each agent, nothing ever taken back.
    mpot     no sequence: the waypoints of all agents are transported at once.

``fsot`` and ``mpot`` have none of the readings that ``paper`` adds: samples around a neighbour, ``until`` as a
disjunction, a smaller weight of goals that later agents may satisfy.

What ``paper`` keeps of ours: positions for states, a rotation for each waypoint, steps smoothed over
time (without that next to nothing is found, see ``transport``), scores normalised by visits, and starts
and finishes that are regions taken from a key frame, for the paper has none of those.

The paper optimises 800 to 1000 trajectories at once on a GPU; ``samples`` is how many here. Where it is not said
(``--samples``), it is 96 on a CPU, and the paper's 800 on a GPU. ``paper`` shares them among the nodes of a round, so
that the fewer nodes there are, the more trajectories each has.

Source:
    [clot] Algorithms 1 and 2; V-A.3 (I) and (II) for ``mpot`` and ``fsot``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum, auto

from missionc.backends.clot.settings import ClotSettings, Coupling, SearchSettings, TransportSettings, clot_settings
from missionc.backends.clot.spec import CLOT
from missionc.backends.options import Options
from missionc.backends.setting import own_values, with_values
from missionc.ir import Mission


class SequenceChoice(Enum):
    """In which order agents are planned."""

    TOGETHER = auto()
    """In none: all at once."""
    FIXED = auto()
    """One sequence, breadth first."""
    SEARCHED = auto()
    """Every valid sequence may be tried."""


@dataclass(frozen=True, slots=True)
class Preset:
    """How candidates are made.

    Args:
        local: whether Algorithm 1 moves anything at all.
        seeded: candidates begin at the sketch, pass the key frames, and keep to the schedule's choices.
        polished: what is found is polished jointly.
        slack: metres by which a partial team may fail where that follows.
        deviation: of the prior half-way between two ends, for a world 10 m wide, metres.
        settled: an expansion ends once enough candidates hold with something to spare.
        reward: what a metre of the goals' mean robustness is worth to a candidate, beside a metre of margin that one of
            them lacks.
        published: how many trajectories the paper optimises at once on its GPU; 0 where it has no such preset.
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
        """The same with the values that a mission has of its search and transport."""
        values = {
            name: each for name, each in own_values(mission, CLOT.name) if name.startswith(("search.", "transport."))
        }
        own = with_values(ClotSettings(search=self.search, transport=self.transport), values)
        return replace(self, search=own.search, transport=own.transport)

    def with_samples(self, samples: int | None, device: str = "cpu") -> Preset:
        """The same with so many trajectories optimised at once; with as many as published, on a GPU and not told."""
        if samples is None and device != "cpu":
            samples = self.published or None
        if samples is None:
            return self
        few = max(1, samples * self.search.narrow // self.search.wide) if self.search.printed else samples
        return replace(self, search=replace(self.search, few_samples=few, many_samples=samples))


PAPER = SearchSettings(few_samples=200, many_samples=800, children=800, printed=True, eta=0.01)
"""As many trajectories as scenarios 1 and 2 optimise at once, shared by the nodes of a round; scenario 3 takes 1000.
Each that is feasible makes a node.

Source:
    [clot] V-A.1.
"""

FSOT = SearchSettings(wide=1, narrow=1, children=1, tries=1)
"""One motion for each agent, never taken back; with ``planning_sequence.in_order``, the ablation with a fixed sequence.

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
    """The preset of that name, with so many trajectories where a number is given, or as many as the device is for.

    Raises:
        ValueError: there is no such preset, or the number is less than 1.
    """
    if name not in PRESETS:
        raise ValueError(f"there is no preset `{name}`; there are {', '.join(PRESETS)}")
    if samples is not None and samples < 1:
        raise ValueError(f"many_samples = {samples} is below 1")
    return PRESETS[name].with_samples(samples, device)


def fewer_samples(way: Preset, samples: int | None, device: str) -> str | None:
    """What to say where a preset works with fewer trajectories than the paper because no GPU was asked for."""
    if samples is not None or device != "cpu" or not way.published:
        return None
    return (
        f"preset `{way.name}` moved {way.search.many_samples} trajectories at once, where the paper has {way.published}"
        " on a GPU: `--device cuda` takes as many, and `--samples` says how many"
    )


def tuned_settings(mission: Mission, options: Options) -> ClotSettings:
    """All settings of a mission; those of search and transport as the preset has them, ``search`` for ``sketch``."""
    name = options.preset if options.preset in PRESETS and PRESETS[options.preset].local else "search"
    searching = preset(name, options.samples, options.device).tuned(mission)
    return replace(clot_settings(mission), search=searching.search, transport=searching.transport)
