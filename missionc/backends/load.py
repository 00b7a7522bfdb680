"""From a backend's name to the backend; the only late imports in the project."""

from __future__ import annotations

from importlib.util import find_spec

from missionc.backends.api import Backend, Options
from missionc.diagnostics.code import EXTRA_MISSING, NO_DEVICE, NOT_ITS_FLAG
from missionc.diagnostics.model import Diagnostic


def load(name: str, options: Options | None = None, checkpoint: bool = False) -> Backend | Diagnostic:
    """The backend of that name, or what to say where a package that it needs is not there.

    Args:
        checkpoint: whether the run is to be kept, or is one taken up again.

    Raises:
        KeyError: no backend has that name.
    """
    if checkpoint and name == "smt":
        return _not_its_flag("--checkpoint` or `--resume")
    return {"smt": _smt, "clot": _clot, "hybrid": _hybrid}[name](options or Options())


def _smt(options: Options) -> Backend | Diagnostic:
    none = Options()
    for flag in ("preset", "device", "processes"):
        if (value := getattr(options, flag)) != getattr(none, flag):
            return _not_its_flag(f"--{flag} {value}")
    missing = _missing_for_solvers(options)
    if missing is not None:
        return missing
    from missionc.backends.smt import BACKEND

    return BACKEND


def _clot(options: Options) -> Backend | Diagnostic:
    if find_spec("torch") is None:
        return _torch_missing("clot")
    missing = _device_missing(options)
    if missing is not None:
        return missing
    from missionc.backends.clot.backend import BACKEND

    return BACKEND


def _hybrid(options: Options) -> Backend | Diagnostic:
    if find_spec("torch") is None:
        return _torch_missing("hybrid")
    missing = _missing_for_solvers(options) or _device_missing(options)
    if missing is not None:
        return missing
    from missionc.backends.hybrid import BACKEND

    return BACKEND


def _missing_for_solvers(options: Options) -> Diagnostic | None:
    if find_spec("pysat") is None:
        if options.solver != "z3":
            return _sat_missing(f"--solver {options.solver}", "leave `--solver` out: Z3 is always there")
        if options.certify:
            return _sat_missing("--certify", "leave `--certify` out: the answer is the same, without a proof of it")
    return None


def _device_missing(options: Options) -> Diagnostic | None:
    from missionc.backends.clot.torch_device import available

    if available(options.device):
        return None
    return Diagnostic(
        NO_DEVICE,
        f"torch has no device `{options.device}` here",
        None,
        notes=("either there is no such GPU, or its driver or torch's own build for it is missing",),
        help="leave `--device` out: the CPU is always there",
    )


def _torch_missing(name: str) -> Diagnostic:
    return Diagnostic(
        EXTRA_MISSING,
        f"the backend `{name}` needs the package torch, which is not installed",
        None,
        help="install it with `pip install 'missionc[clot]'`, or try `--backend smt`",
    )


def _sat_missing(flag: str, otherwise: str) -> Diagnostic:
    return Diagnostic(
        EXTRA_MISSING,
        f"`{flag}` needs the package python-sat, which is not installed",
        None,
        help=f"install it with `pip install 'missionc[sat]'`, or {otherwise}",
    )


def _not_its_flag(flag: str) -> Diagnostic:
    return Diagnostic(
        NOT_ITS_FLAG,
        f"`{flag}` is for the backends `clot` and `hybrid`, and this mission goes to `smt`",
        None,
        notes=("it is about planning by transport; a SAT solver over roadmaps does nothing with it",),
        help="leave it out, or plan with `--backend clot`, where the mission allows it",
    )
