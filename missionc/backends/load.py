"""Loading of a backend by name, or of several backends as a portfolio."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import cast

from missionc.backends.api import Backend, BackendExtension, Improvement, Report
from missionc.backends.features import BackendSpec
from missionc.backends.foreign_backend import ForeignBackend
from missionc.backends.options import DESCRIBED, Options
from missionc.backends.portfolio.backend import Engine, PortfolioBackend
from missionc.backends.registry import BACKENDS
from missionc.backends.smt.spec import SMT
from missionc.base.diagnostics.code import EXTRA_MISSING, NOT_ITS_FLAG
from missionc.base.diagnostics.defect import extension_error
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.extensions import ExtensionError, raise_taken, resolved
from missionc.base.trace import Trace
from missionc.ir.wording import all_listed


def load(name: str, options: Options | None = None, checkpoint: bool = False) -> Backend | Diagnostic:
    """Backend with this name, or the finding that it is not installed or does not support an option."""
    return load_engines((name,), options, checkpoint)


def load_engines(
    names: Sequence[str], options: Options | None = None, checkpoint: bool = False
) -> Backend | Diagnostic:
    """Load the backend of that name, or a portfolio of several; or return a diagnostic for these options.

    Of several, those that support every flag are used. A run with checkpoints uses only the first of them.

    Args:
        checkpoint: True if the run is saved or resumed.

    Raises:
        KeyError: no backend has that name.
    """
    options = options or Options()
    try:
        raise_taken()
        specs = [BACKENDS[name] for name in names]
    except ExtensionError as error:
        return extension_error(error)
    wrong = {spec.name: _not_its_flag(spec, options, checkpoint, len(specs) == 1) for spec in specs}
    hear = [spec for spec in specs if wrong[spec.name] is None]
    if not hear:
        return next(said for said in wrong.values() if said is not None)
    lacking = next((said for spec in hear if (said := _package_missing(spec, options)) is not None), None)
    if lacking is not None:
        return lacking
    there = hear[: 1 if checkpoint else None]
    flagged = any(each.refused and getattr(options, each.name) != each.default for each in DESCRIBED.values())
    at_once = len(there) == 1 or flagged
    backends = {spec.name: _loaded(spec) for spec in there if at_once or not spec.package}
    missing = [said for backend in backends.values() if (said := backend.missing(options)) is not None]
    if missing:
        return missing[0]
    if len(there) == 1:
        return backends[there[0].name]
    engines = tuple(
        Engine(spec.name, partial(_loaded, spec), any(each.name == spec.subsumes for each in there)) for spec in there
    )
    return PortfolioBackend(engines)


def _loaded(spec: BackendSpec) -> Backend:
    if isinstance(spec.home, str):
        return cast(Backend, resolved(spec.home))
    return ForeignBackend(cast(BackendExtension, spec.home))


def plans_on_roadmaps(engine: str) -> bool:
    """Return true if the plans of a backend follow the edges of a roadmap."""
    return engine == SMT.name


def load_straighten(engine: str) -> Improvement | None:
    """Function that straightens an engine's roadmap plans; None for other engines."""
    if not plans_on_roadmaps(engine):
        return None
    straighten: Improvement = import_module("missionc.backends.clot.straighten").straighten
    return straighten


def load_widen() -> Improvement:
    """Function that widens the margins of a plan."""
    widen: Improvement = import_module("missionc.backends.clot.widen").widen
    return widen


def load_roadmaps() -> Backend:
    """Portfolio that contains only the roadmap backend, with straightened plans."""
    return PortfolioBackend((Engine(SMT.name, partial(_loaded, SMT)),))


def load_repair(motion: Trace, found: Report | None = None) -> Backend:
    """Search for a plan near a motion, whose own search reported ``found``."""
    repair: Backend = import_module("missionc.backends.clot.repair").Repair(motion, found or Report())
    return repair


def _not_its_flag(spec: BackendSpec, options: Options, checkpoint: bool, alone: bool) -> Diagnostic | None:
    """Finding about the first option that the backend does not support and may not ignore; None without such an option.

    Args:
        alone: True if no other backend is used.
    """
    every = [each for _, each in BACKENDS.items_built_in()]
    if checkpoint and not spec.checkpoints:
        return _for_others("--checkpoint` or `--resume", [each.name for each in every if each.checkpoints], spec)
    for each in DESCRIBED.values():
        value = getattr(options, each.name)
        if each.refused and value != each.default and not _hears(spec, each.name, value, alone):
            hear = [other.name for other in every if _hears(other, each.name, value, alone=True)]
            return _for_others(" ".join(each.words(options)), hear, spec)
    return None


def _hears(spec: BackendSpec, name: str, value: object, alone: bool) -> bool:
    """Return true if the option with this value affects the plans of the backend."""
    if name == "preset":
        return value in spec.presets and (alone or name in spec.options)
    return name in spec.options


def _for_others(flag: str, names: list[str], spec: BackendSpec) -> Diagnostic:
    others = all_listed([f"`{name}`" for name in names])
    return Diagnostic(
        NOT_ITS_FLAG,
        f"`{flag}` is for {others}, but `{spec.name}` plans this mission",
        None,
        help=f"plan with `--backend {names[0]}`",
    )


def _package_missing(spec: BackendSpec, options: Options) -> Diagnostic | None:
    needs = next((name for name, values in spec.package_needs if getattr(options, name) in values), None)
    if needs is None or find_spec(spec.package) is not None:
        return None
    return Diagnostic(
        EXTRA_MISSING,
        f"`{' '.join(DESCRIBED[needs].words(options))}` needs the package {spec.package}, which is not installed",
        None,
        help=f"install it with `pip install 'missionc[{spec.extra}]'`",
    )
