"""Presets: named planning methods, each of which omits or restores a part, for comparisons.

    sketch   schedule, joint waypoints, one initial trajectory, local optimisation (polish); every eighth attempt is a
             ``search``. The default.
    search   Algorithm 2 over Algorithm 1, seeded with the initial trajectory and its schedule; polish at the end.
    paper    Algorithm 2 over Algorithm 1 as published: the four rules, exact Sinkhorn, trajectories from the prior, (9)
             and the sequences as printed, no polish.
    fsot     one fixed sequence, breadth first, one trajectory for each agent, without backtracking.
    mpot     no sequence: the waypoints of all agents are transported together.

``fsot`` and ``mpot`` lack the interpretations of ``paper``: samples around a neighbour, ``until`` as a disjunction, a
smaller weight of goals that later agents may satisfy.

``paper`` retains some parts of ``search``: positions for states, a rotation for each waypoint, and scores normalised by
visits. Steps are smoothed over time; without smoothing, almost nothing is found (see ``transport``). Positions in start
and finish regions, which the paper does not have, come from a joint waypoint.

The paper optimises 800 to 1000 trajectories at once on a GPU; ``samples`` is their number here. By default (without
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
    """Order in which the agents are planned."""

    TOGETHER = auto()
    """No order: all agents are planned at once."""
    FIXED = auto()
    """One sequence of agents, breadth first."""
    SEARCHED = auto()
    """Every valid sequence of agents may be tried."""


class Preset(Record):
    """Named method of generating candidate trajectories.

    Args:
        local: True if Algorithm 1 is used.
        seeded: True if candidates start from the initial trajectory, pass the joint waypoints, and use the schedule's
            choices.
        polished: True if results are optimised jointly.
        slack: violation allowed for a partial team before the joint optimisation, metres.
        deviation: standard deviation of the prior half-way between two ends, for a world 10 m wide, metres.
        settled: True if an expansion ends once enough candidates are feasible with a margin.
        reward: weight of a metre of the goals' mean robustness against a metre of a goal's shortfall.
        published: number of trajectories in the paper's GPU batches; 0 if the paper has no such method.
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
        """Preset with the mission's values of the ``search`` and ``transport`` settings."""
        values = {
            name: each for name, each in own_values(mission, CLOT.name) if name.startswith(("search.", "transport."))
        }
        own = with_values(ClotSettings(search=self.search, transport=self.transport), values)
        return replace(self, search=own.search, transport=own.transport)

    def with_samples(self, samples: int | None, device: str = "cpu") -> Preset:
        """Preset with ``samples`` trajectories; if None on a GPU, with the published number."""
        if samples is None and device != "cpu":
            samples = self.published or None
        if samples is None:
            return self
        few = max(1, samples * self.search.narrow // self.search.wide) if self.search.printed else samples
        return replace(self, search=replace(self.search, few_samples=few, many_samples=samples))


PAPER = SearchSettings(few_samples=200, many_samples=800, children=800, printed=True, eta=0.01)
"""Numbers of trajectories of scenarios 1 and 2, divided among the nodes of a round; scenario 3 uses 1000.

Source:
    [clot] V-A.1.
"""

FSOT = SearchSettings(wide=1, narrow=1, children=1, tries=1)
"""Settings for one trajectory per agent without backtracking; with ``planning_sequence.in_order``, the ablation with a
fixed sequence.

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
    """Preset with this name, with ``samples`` trajectories or the default for the device.

    Raises:
        ValueError: the preset is unknown, or ``samples`` is less than 1.
    """
    if name not in PRESETS:
        raise ValueError(f"unknown preset `{name}`; use one of {', '.join(PRESETS)}")
    if samples is not None and samples < 1:
        raise ValueError(f"many_samples = {samples} is below 1")
    return PRESETS[name].with_samples(samples, device)


def fewer_samples(way: Preset, samples: int | None, device: str) -> str | None:
    """Note that a preset uses fewer trajectories than the paper because no GPU was requested; None otherwise."""
    if samples is not None or device != "cpu" or not way.published:
        return None
    return (
        f"preset `{way.name}` optimized {way.search.many_samples} trajectories together; the paper uses {way.published}"
        " on a GPU: `--device cuda` uses as many, and `--samples` sets the number"
    )


def tuned_settings(mission: Mission, options: Options) -> ClotSettings:
    """All settings of a mission, with ``search`` and ``transport`` from the preset (from ``search`` for the preset
    ``sketch``)."""
    name = options.preset if options.preset in PRESETS and PRESETS[options.preset].local else "search"
    searching = preset(name, options.samples, options.device).tuned(mission)
    return replace(clot_settings(mission), search=searching.search, transport=searching.transport)
