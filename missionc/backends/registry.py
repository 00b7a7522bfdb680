"""Registry of the built-in backends and of backends of extensions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from missionc.backends.clot.spec import CLOT
from missionc.backends.features import BackendSpec, Feature
from missionc.backends.hybrid.spec import HYBRID
from missionc.backends.options import DESCRIBED, OWN_PRESETS, Options
from missionc.backends.smt.spec import SMT
from missionc.base.diagnostics.code import EXTENSION_UNLOADABLE
from missionc.base.extensions import ExtensionError, Kind, Registry, Unfit, raise_misnamed


def spec_of(name: object, backend: object) -> BackendSpec:
    """Description of an extension's backend object, from its members as in ``BackendExtension``.

    Raises:
        Unfit: the object is no backend with this name.
    """
    if isinstance(backend, type) or not callable(getattr(backend, "plan", None)):
        raise Unfit("a backend is an object with `name`, `features` and `plan`, as `BackendExtension` describes it")
    own, features, options = (getattr(backend, each, None) for each in ("name", "features", "options"))
    raise_misnamed(own)
    if own != name:
        raise Unfit(f"its `name` is not `{name}`")
    if not (isinstance(features, frozenset) and all(isinstance(each, Feature) for each in features)):
        raise Unfit("its `features` are no `frozenset` of `Feature`")
    if options is not None and not (isinstance(options, frozenset) and options <= DESCRIBED.keys()):
        raise Unfit("its `options` are no `frozenset` of names of `Options`")
    return BackendSpec(str(own), features, options or frozenset(), checkpoints=False, home=backend)


BACKENDS = Registry(Kind.BACKEND, {spec.name: spec for spec in (SMT, CLOT, HYBRID)}, spec_of)
"""Registry of all backends. ``auto`` uses the built-in backends in this order; extensions are used only by name."""


def is_published(engines: Sequence[str], options: Options) -> bool:
    """Return true if the only backend uses the published method of a paper: its plan is accepted or rejected without
    further steps."""
    return len(engines) == 1 and options.preset in BACKENDS[engines[0]].presets - set(OWN_PRESETS)


@contextmanager
def named(backend: str | object) -> Iterator[str]:
    """Context that yields the name of a backend; a backend object is registered inside the context.

    An installed backend with the same name and class is replaced by the object inside the context.

    Raises:
        ExtensionError: the object is no backend, or its name is taken.
    """
    if isinstance(backend, str):
        yield backend
        return
    name = getattr(backend, "name", None)
    try:
        spec = spec_of(name, backend)
    except Unfit as error:
        message = f"the backend `{name}` cannot be used: {error}"
        raise ExtensionError(EXTENSION_UNLOADABLE, message, "correct its class") from None
    with BACKENDS.lent(spec.name, spec, lambda installed: type(installed.home) is type(backend)):
        yield spec.name


AUTO = "auto"
"""Name that stands for all backends that support the mission, in turns."""
