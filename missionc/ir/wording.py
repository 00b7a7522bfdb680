"""Wording of quantities and of name lists for messages."""

from __future__ import annotations

from collections.abc import Sequence

from missionc.ir import Mission, Spacing

SHOWN = 3
"""Maximum number of names that a long list shows; the others are counted."""


def number(value: float) -> str:
    """Number as text without trailing zeros: ``4.7``, ``0.1``, ``20``."""
    return f"{round(value, 9) + 0.0:.10g}"


def point(place: Sequence[float]) -> str:
    """Coordinates as text, rounded to a centimetre: ``(1.25, 0)``."""
    return f"({', '.join(number(round(value, 2)) for value in place)})"


def metres(value: float) -> str:
    """Length as text, rounded to a tenth of a millimetre: ``3.6056 m``."""
    return f"{number(round(value, 4))} m"


def spaced(spacing: Spacing) -> str:
    """Required separation of two centres as text: ``0.4 m``, or ``0.4 m sideways or 0.72 m in height``."""
    if spacing.sideways == spacing.height:
        return metres(spacing.sideways)
    return f"{at_least_metres(spacing.sideways)} sideways or {at_least_metres(spacing.height)} in height"


def at_least_metres(value: float) -> str:
    """Length as text, rounded up to a tenth of a millimetre, for lower limits."""
    rounded = round(value, 4)
    return f"{number(rounded if rounded >= value - 1e-9 else rounded + 1e-4)} m"


def speed(value: float) -> str:
    return f"{number(round(value, 4))} m/s"


def seconds(mission: Mission, steps: float) -> str:
    """Duration of ``steps`` steps of the mission as text: ``16 s``."""
    return f"{number(steps * mission.step)} s"


def listed(names: Sequence[str]) -> str:
    """List of names as text: ``a``, ``a and b``, ``a, b and c``, ``a, b, c and 5 more``."""
    if len(names) > SHOWN:
        return f"{', '.join(names[:SHOWN])} and {len(names) - SHOWN:,} more"
    return all_listed(names)


def all_listed(names: Sequence[str]) -> str:
    """List of all names as text, however many: ``a, b, c, d and e``."""
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)
