"""The kinds of dynamics, each in a file of its own. This tuple is the only registration."""

from __future__ import annotations

from types import MappingProxyType

from missionc.ir.dynamics.double_integrator import DoubleIntegrator as DoubleIntegrator
from missionc.ir.dynamics.kind import Dynamics as Dynamics
from missionc.ir.dynamics.kind import Limit as Limit
from missionc.ir.dynamics.single_integrator import SingleIntegrator as SingleIntegrator
from missionc.ir.dynamics.unicycle import Unicycle as Unicycle

DYNAMICS: tuple[type[Dynamics], ...] = (SingleIntegrator, DoubleIntegrator, Unicycle)

by_word: MappingProxyType[str, type[Dynamics]] = MappingProxyType({kind.word: kind for kind in DYNAMICS})
"""Each kind under its word."""


def velocity_chosen_anew(speed: float) -> Dynamics:
    """The dynamics of one that may choose another velocity in every step, of up to so many metres a second."""
    return SingleIntegrator(speed)
