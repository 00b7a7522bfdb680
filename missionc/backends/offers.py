"""The table of backends: every one there is, by its name. A new one is a folder here and a line in this file."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

from missionc.backends.clot.offer import CLOT
from missionc.backends.features import Offer
from missionc.backends.hybrid.offer import HYBRID
from missionc.backends.options import Options
from missionc.backends.smt.offer import SMT

OFFERS: MappingProxyType[str, Offer] = MappingProxyType({offer.name: offer for offer in (SMT, CLOT, HYBRID)})
"""Every backend, in the order in which ``auto`` gives them turns."""


def is_published(engines: Sequence[str], options: Options) -> bool:
    """Whether the roadmap planner alone is asked, for the method of its paper and nothing beside it."""
    return tuple(engines) == (SMT.name,) and options.preset in SMT.presets


AUTO = "auto"
"""Stands for all backends that offer what a mission needs, in turns."""
