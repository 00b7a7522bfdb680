"""Installed SAT solvers: Z3 always; CaDiCaL, and proofs with it, from an optional package."""

from __future__ import annotations

from importlib.util import find_spec

from missionc.backends.options import Options
from missionc.backends.smt.sat.solve import SOLVERS
from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.model import Diagnostic


def solver_missing(options: Options) -> Diagnostic | None:
    """Finding if the options need a solver or a proof that is not installed; None otherwise."""
    if find_spec("pysat") is not None:
        return None
    if "cadical" in SOLVERS[options.solver]:
        return _missing(f"--solver {options.solver}", "remove `--solver`: the solver Z3 is always installed")
    if options.certify:
        return _missing("--certify", "remove `--certify`: the result is the same without a written proof")
    return None


def _missing(flag: str, otherwise: str) -> Diagnostic:
    return Diagnostic(
        EXTRA_MISSING,
        f"`{flag}` needs the package python-sat, which is not installed",
        None,
        help="install it with `pip install 'missionc[sat]'`",
    )
