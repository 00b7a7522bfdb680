"""Registry of the kinds of dynamics; each kind has its own file.

The tuple ``DYNAMICS`` is the only registration of the built-in kinds.
"""

from __future__ import annotations

import math
from dataclasses import fields

from missionc.base.extensions import Kind, Registry, Unfit, guard, rejected
from missionc.base.units import Dimension
from missionc.ir.dynamics.kinds import DoubleIntegrator as DoubleIntegrator
from missionc.ir.dynamics.kinds import Dynamics as Dynamics
from missionc.ir.dynamics.kinds import Limit as Limit
from missionc.ir.dynamics.kinds import SingleIntegrator as SingleIntegrator
from missionc.ir.dynamics.kinds import Unicycle as Unicycle

DYNAMICS: tuple[type[Dynamics], ...] = (SingleIntegrator, DoubleIntegrator, Unicycle)


def _kind(word: str, kind: object) -> type[Dynamics]:
    if not (isinstance(kind, type) and issubclass(kind, Dynamics)):
        raise Unfit("a kind of dynamics is a class that extends `Dynamics`")
    missing = sorted(kind.__abstractmethods__)
    if missing:
        raise Unfit(f"its class has no {' and no '.join(f'`{each}`' for each in missing)}")
    if getattr(kind, "word", "") != word:
        raise Unfit(f"its `word` is not `{word}`")
    own = {each.name for each in fields(kind)}
    for limit in kind.limits:
        if not (isinstance(limit, Limit) and isinstance(limit.dimension, Dimension) and limit.setting in own):
            setting = getattr(limit, "setting", limit)
            raise Unfit(f"its limit `{setting}` is no `Limit` with a `Dimension` and a field `{setting}` of the class")
    if not (isinstance(kind.rules, tuple) and all(isinstance(each, str) for each in kind.rules)):
        raise Unfit("its `rules` are no tuple of names")
    return kind


KINDS: Registry[type[Dynamics]] = Registry(Kind.DYNAMICS, {kind.word: kind for kind in DYNAMICS}, _kind)
"""Kinds of dynamics by their word in missions, including kinds of extensions."""


def of_kind(kind: type[Dynamics], slowest: float, fastest: float, *limits: float) -> Dynamics:
    """Dynamics of a kind with the given speed limits, m/s, and further limits, SI units.

    Raises:
        Unfit: the kind cannot have these limits.
        ExtensionError: the code of an extension's kind failed.
    """
    with guard(Kind.DYNAMICS, kind.word, Unfit):
        return _with_sound_facts(kind.word, kind.of(slowest, fastest, *limits))


def at_most(dynamics: Dynamics, speed: float, acceleration: float) -> Dynamics:
    """Dynamics of the same kind with lower limits on speed, m/s, and acceleration, m/s² (if the kind limits it).

    Raises:
        ExtensionError: the code of an extension's kind failed.
    """
    with guard(Kind.DYNAMICS, dynamics.word):
        slower = _with_sound_facts(dynamics.word, dynamics.at_most(speed, acceleration))
        if slower.top_speed < min(speed, dynamics.top_speed) * (1 - ROUNDING) or slower.top_speed > dynamics.top_speed:
            says = f"has the top speed {slower.top_speed:g} m/s of `at_most({speed:g}, {acceleration:g})`"
            raise rejected(Kind.DYNAMICS, dynamics.word, says)
        return slower


ROUNDING = 1e-9
"""Relative rounding error of a speed that is tolerated."""


def _with_sound_facts(word: str, dynamics: object) -> Dynamics:
    """Return the dynamics of an extension unchanged after checking their type and numbers.

    Raises:
        ExtensionError: the value is no ``Dynamics``, or one of its limits is unusable.
    """
    if not isinstance(dynamics, Dynamics):
        raise rejected(Kind.DYNAMICS, word, "returned a value that is no `Dynamics`")
    for name in ("top_speed", "lowest_speed", "top_acceleration", "top_turn"):
        value = getattr(dynamics, name)
        number = isinstance(value, int | float) and not isinstance(value, bool) and value >= 0
        if not number or (name.endswith("speed") and value == math.inf):
            raise rejected(Kind.DYNAMICS, word, f"has the {name.replace('_', ' ')} `{value!r:.40}`, which cannot be")
    if dynamics.lowest_speed > dynamics.top_speed:
        raise rejected(Kind.DYNAMICS, word, f"has a lowest speed above its top speed, {dynamics.top_speed:g} m/s")
    return dynamics


def velocity_chosen_anew(speed: float) -> Dynamics:
    """Single-integrator dynamics: the velocity may change at every step, up to ``speed``, m/s."""
    return SingleIntegrator(speed)
