"""The table of backends: every one there is, by its name. A new one is a folder here and a line in this file."""

from __future__ import annotations

from types import MappingProxyType

from missionc.backends.clot.offer import CLOT
from missionc.backends.features import Offer
from missionc.backends.hybrid.offer import HYBRID
from missionc.backends.smt.offer import SMT

OFFERS: MappingProxyType[str, Offer] = MappingProxyType({offer.name: offer for offer in (SMT, CLOT, HYBRID)})
"""Every backend, in the order in which ``auto`` gives them turns."""

AUTO = "auto"
"""Stands for all backends that offer what a mission needs, in turns."""
