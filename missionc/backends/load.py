"""Loading of a backend by its name, or the finding that it cannot be had with these options here."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

from missionc.backends.api import Backend, Straighten
from missionc.backends.clot.offer import CLOT
from missionc.backends.features import Offer
from missionc.backends.offers import OFFERS
from missionc.backends.options import DESCRIBED, Options
from missionc.backends.smt.offer import SMT
from missionc.diagnostics.code import EXTRA_MISSING, NOT_ITS_FLAG
from missionc.diagnostics.model import Diagnostic


def load(name: str, options: Options | None = None, checkpoint: bool = False) -> Backend | Diagnostic:
    """The backend of that name, or what to say where a package that it needs is not there.

    Args:
        checkpoint: whether the run is to be kept, or is one taken up again.

    Raises:
        KeyError: no backend has that name.
    """
    offer, options = OFFERS[name], options or Options()
    wrong = _not_its_flag(offer, options, checkpoint) or _package_missing(offer)
    if wrong is not None:
        return wrong
    backend: Backend = import_module(offer.home).BACKEND
    return backend.missing(options) or backend


def load_straighten(engine: str) -> Straighten | None:
    """What makes plans of an engine straighter that come from a roadmap, where what it needs is installed."""
    if engine != SMT.name or find_spec(CLOT.package) is None:
        return None
    straighten: Straighten = import_module("missionc.backends.clot.straighten").straighten
    return straighten


def _not_its_flag(offer: Offer, options: Options, checkpoint: bool) -> Diagnostic | None:
    """The first flag that is for other backends and may not be passed over."""
    if checkpoint and not offer.checkpoints:
        return _for_others(
            "--checkpoint` or `--resume", [each.name for each in OFFERS.values() if each.checkpoints], offer
        )
    for each in DESCRIBED.values():
        value = getattr(options, each.name)
        if each.refused and value != each.default and each.name not in offer.options:
            hear = [other.name for other in OFFERS.values() if each.name in other.options]
            return _for_others(f"--{each.name} {value}", hear, offer)
    return None


def _for_others(flag: str, names: list[str], offer: Offer) -> Diagnostic:
    others = " and ".join(f"`{name}`" for name in names)
    return Diagnostic(
        NOT_ITS_FLAG,
        f"`{flag}` is for the backends {others}, and this mission goes to `{offer.name}`",
        None,
        notes=("it is about planning by transport; a SAT solver over roadmaps does nothing with it",),
        help=f"leave it out, or plan with `--backend {names[0]}`, where the mission allows it",
    )


def _package_missing(offer: Offer) -> Diagnostic | None:
    if not offer.package or find_spec(offer.package) is not None:
        return None
    return Diagnostic(
        EXTRA_MISSING,
        f"the backend `{offer.name}` needs the package {offer.package}, which is not installed",
        None,
        help=f"install it with `pip install 'missionc[{offer.extra}]'`, or try `--backend {next(iter(OFFERS))}`",
    )
