"""Registry of the built-in backends and of those of extensions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from missionc.backends.clot.spec import CLOT
from missionc.backends.features import BackendSpec, Feature
from missionc.backends.hybrid.spec import HYBRID
from missionc.backends.options import OWN_PRESETS, Options
from missionc.backends.smt.spec import SMT
from missionc.base.extensions import Kind, Registry, Unfit


def spec_of(name: str, backend: object) -> BackendSpec:
    """Description of a ``BackendExtension``.

    Raises:
        Unfit: the object is no backend of this name.
    """
    features = getattr(backend, "features", None)
    if isinstance(backend, type) or not (callable(getattr(backend, "plan", None)) and isinstance(features, frozenset)):
        raise Unfit("a backend is an object with `name`, `features` and `plan`, as `BackendExtension` describes it")
    if not all(isinstance(each, Feature) for each in features):
        raise Unfit("its `features` contain something other than a `Feature`")
    if getattr(backend, "name", None) != name:
        raise Unfit(f"its `name` is not `{name}`")
    return BackendSpec(name, features, getattr(backend, "options", frozenset()), checkpoints=False, home=backend)


BACKENDS = Registry(Kind.BACKEND, {spec.name: spec for spec in (SMT, CLOT, HYBRID)}, spec_of)
"""Every backend. ``auto`` gives turns to those built in, in their order; one of an extension plans if it is named."""


def is_published(engines: Sequence[str], options: Options) -> bool:
    """Return whether the only backend uses the method of its paper: its plan is accepted or rejected unchanged."""
    return len(engines) == 1 and options.preset in BACKENDS[engines[0]].presets - set(OWN_PRESETS)


@contextmanager
def named(backend: str | object) -> Iterator[str]:
    """Name of a backend; an object is registered while the context lasts.

    Raises:
        Unfit: the object is not a backend.
        ExtensionError: its name is taken.
    """
    if isinstance(backend, str):
        yield backend
        return
    name = str(getattr(backend, "name", ""))
    with BACKENDS.lent(name, spec_of(name, backend)):
        yield name


AUTO = "auto"
"""Name for all backends that offer the mission's features, in turns."""
