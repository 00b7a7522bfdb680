"""The table of backends: every one there is, by its name. A new one is a folder here and a line in this file."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

from missionc.backends.clot.offer import CLOT
from missionc.backends.features import Offer
from missionc.backends.hybrid.offer import HYBRID
from missionc.backends.options import OWN_PRESETS, Options
from missionc.backends.smt.offer import SMT

OFFERS: MappingProxyType[str, Offer] = MappingProxyType({offer.name: offer for offer in (SMT, CLOT, HYBRID)})
"""Every backend, in the order in which ``auto`` gives them turns."""


def is_published(engines: Sequence[str], options: Options) -> bool:
    """Whether the only backend plans by a method of its paper: its plan is taken or refused, and nothing is added."""
    return len(engines) == 1 and options.preset in OFFERS[engines[0]].presets - set(OWN_PRESETS)


AUTO = "auto"
"""Stands for all backends that offer what a mission needs, in turns."""
