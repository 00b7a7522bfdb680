"""The kinds of dynamics, each in its own file.

The tuple is the only registration of the built-in kinds.
"""

from __future__ import annotations

from missionc.base.extensions import Kind, Registry, Unfit
from missionc.ir.dynamics.double_integrator import DoubleIntegrator as DoubleIntegrator
from missionc.ir.dynamics.kind import Dynamics as Dynamics
from missionc.ir.dynamics.kind import Limit as Limit
from missionc.ir.dynamics.single_integrator import SingleIntegrator as SingleIntegrator
from missionc.ir.dynamics.unicycle import Unicycle as Unicycle

DYNAMICS: tuple[type[Dynamics], ...] = (SingleIntegrator, DoubleIntegrator, Unicycle)


def _kind(word: str, kind: object) -> type[Dynamics]:
    if not (isinstance(kind, type) and issubclass(kind, Dynamics)):
        raise Unfit("a kind of dynamics is a class that extends `Dynamics`")
    missing = sorted(kind.__abstractmethods__)
    if missing:
        raise Unfit(f"its class has no {' and no '.join(f'`{each}`' for each in missing)}")
    if getattr(kind, "word", "") != word:
        raise Unfit(f"its `word` is not `{word}`")
    return kind


KINDS: Registry[type[Dynamics]] = Registry(Kind.DYNAMICS, {kind.word: kind for kind in DYNAMICS}, _kind)
"""Each kind under its word, including those of extensions."""


def velocity_chosen_anew(speed: float) -> Dynamics:
    """Dynamics whose velocity may change at every step, up to ``speed``, m/s."""
    return SingleIntegrator(speed)
