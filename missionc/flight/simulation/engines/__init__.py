"""Simulation engines: the built-in one, and other engines that are installed.

Other engines have their own vehicle and controller. Their setpoints are those of a Crazyflie's firmware.

    says MC404
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from importlib.util import find_spec
from typing import TypeAlias

import numpy as np

from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.extensions import Kind, guard, rejected
from missionc.flight.simulation.default_engine import Flown, sample_times
from missionc.flight.simulation.trial_bounds import ENGINES, OTHERS
from missionc.geometry.curves.piecewise_polynomials import Pieces

LONGEST = 200
"""Maximum number of characters of an engine's error text that a message quotes."""

Engine: TypeAlias = Callable[[Sequence[Pieces], float], Flown]
"""Function that simulates one undisturbed flight of ``seconds``."""


def missing(name: str) -> Diagnostic | None:
    """Diagnostic of an engine that is not installed; None if it is installed."""
    if name not in OTHERS or find_spec(name):
        return None
    message = f"`--engine {name}` needs the package {name}, which is not installed"
    help_ = f"install it with `pip install 'missionc[{name}]'`"
    return Diagnostic(EXTRA_MISSING, message, None, help=help_)


class EngineError(Exception):
    """Error: an installed engine does not start; the text gives the reason."""


def fly_with(name: str, pieces: Sequence[Pieces], seconds: float) -> Flown:
    """Flight simulated by another package's engine, whose output goes to standard error.

    Raises:
        EngineError: the package cannot be loaded, for example because a dependency is missing.
        ExtensionError: its extension cannot be used, or returns no flight.
    """
    with redirect_stdout(sys.stderr):
        try:
            engine: Engine = ENGINES[name]
        except (ImportError, RuntimeError) as error:
            raise EngineError(str(error).partition("\n")[0][:LONGEST]) from error
        with guard(Kind.SIMULATOR, name):
            flown = engine(pieces, seconds)
            if name in ENGINES.built_in:
                return flown
            shape = (1, len(pieces), sample_times(seconds).size, 3)
            shapes = {"position": shape, "velocity": shape, "heading": shape[:3], "times": shape[2:3]}
            arrays = {field: np.asarray(getattr(flown, field, None), dtype=np.float64) for field in shapes}
            if {field: array.shape for field, array in arrays.items()} != shapes or not isinstance(flown, Flown):
                raise rejected(Kind.SIMULATOR, name, f"returned no `Flown` with positions of the shape {shape}")
            if not all(np.isfinite(array).all() for array in arrays.values()):
                raise rejected(Kind.SIMULATOR, name, "returned a `Flown` with values that are not finite")
    return flown
