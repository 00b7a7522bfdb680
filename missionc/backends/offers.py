"""The registry of backends: those built in, a folder here and a word in this file each, and those of extensions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from missionc.backends.clot.offer import CLOT
from missionc.backends.features import Feature, Offer
from missionc.backends.hybrid.offer import HYBRID
from missionc.backends.options import OWN_PRESETS, Options
from missionc.backends.smt.offer import SMT
from missionc.base.extensions import Kind, Registry, Unfit


def offer_of(name: str, backend: object) -> Offer:
    """The offer of a ``BackendExtension``.

    Raises:
        Unfit: it is none of this name.
    """
    features = getattr(backend, "features", None)
    if isinstance(backend, type) or not (callable(getattr(backend, "plan", None)) and isinstance(features, frozenset)):
        raise Unfit("a backend is an object with `name`, `features` and `plan`, as `BackendExtension` describes it")
    if not all(isinstance(each, Feature) for each in features):
        raise Unfit("its `features` hold something that is no `Feature`")
    if getattr(backend, "name", None) != name:
        raise Unfit(f"its `name` is not `{name}`")
    return Offer(name, features, getattr(backend, "options", frozenset()), checkpoints=False, home=backend)


OFFERS = Registry(Kind.BACKEND, {offer.name: offer for offer in (SMT, CLOT, HYBRID)}, offer_of)
"""Every backend. ``auto`` gives turns to those built in, in their order; one of an extension plans if it is named."""


def is_published(engines: Sequence[str], options: Options) -> bool:
    """Whether the only backend plans by a method of its paper: its plan is taken or refused, and nothing is added."""
    return len(engines) == 1 and options.preset in OFFERS[engines[0]].presets - set(OWN_PRESETS)


@contextmanager
def named(backend: str | object) -> Iterator[str]:
    """The name of a backend; of an object, as long as the context lasts.

    Raises:
        Unfit: the object is no backend.
        ExtensionError: its name is taken.
    """
    if isinstance(backend, str):
        yield backend
        return
    name = str(getattr(backend, "name", ""))
    with OFFERS.lent(name, offer_of(name, backend)):
        yield name


AUTO = "auto"
"""Stands for all backends that offer what a mission needs, in turns."""
