"""Settings fields: a parameter of a backend with range, unit and effect, as a field of a frozen dataclass.

A backend has one settings value, whose fields are groups; each group has one field per setting.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, field, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

from missionc.base.late_dataclass import Record

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from missionc.ir import Mission

Figure = TypeVar("Figure", bool, int, float)
Value = TypeVar("Value", bound="DataclassInstance")

Pairs = tuple[tuple[str, float], ...]
"""Setting values with their dotted names."""


def is_setting(name: str) -> bool:
    """Return true if a name is that of a setting (``smt.nodes``); names of mission parameters have no dot."""
    return "." in name


def flag_of(name: str) -> str:
    """Command-line flag that sets a name: ``--set`` for a setting, ``-D`` for a mission parameter."""
    return "--set" if is_setting(name) else "-D"


def setting(default: Figure, says: str, low: float = 0.0, high: float = 1e12) -> Figure:
    """Field with a default.

    Args:
        says: noun phrase for the value with its unit, and effect of a change, in one line.
        low: least value, included.
        high: greatest value, included.
    """
    made: Figure = field(default=default, metadata={"says": says, "low": low, "high": high})
    return made


class Setting(Record):
    """Setting of a backend with its current value, default, unit, meaning and range.

    Args:
        name: group and field, ``roadmap.nodes``.
        value: current value.
        default: value without presets, options and ``--set``.
    """

    name: str
    value: float
    default: float
    says: str
    low: float
    high: float

    @property
    def group(self) -> str:
        return self.name.rpartition(".")[0]

    @property
    def range(self) -> str:
        """Allowed values as text."""
        if isinstance(self.default, bool):
            return "true or false"
        kind = "a whole number" if isinstance(self.default, int) else "a number"
        return f"{kind} from {self.low:,.13g} to {self.high:,.13g}"

    def read(self, value: object) -> float | None:
        """Value of the setting that a text or a number denotes; None if it is out of range or of the wrong type."""
        text = str(value).strip()
        if isinstance(self.default, bool):
            return {"true": True, "false": False}.get(text.lower())
        try:
            number = int(text) if isinstance(self.default, int) else float(text)
        except ValueError:
            return None
        return number if math.isfinite(number) and self.low <= number <= self.high else None


def settings_of(value: DataclassInstance, prefix: str = "") -> Iterator[Setting]:
    """Yield every setting of a backend's settings value, group by group."""
    for each in fields(value):
        held = getattr(value, each.name)
        if dataclasses.is_dataclass(held):
            yield from settings_of(held, f"{prefix}{each.name}.")  # type: ignore[arg-type]
        elif "says" in each.metadata:
            yield Setting(f"{prefix}{each.name}", held, _default(each), **each.metadata)


def _default(each: dataclasses.Field[Any]) -> float:
    assert each.default is not MISSING
    value: float = each.default
    return value


def with_values(value: Value, pairs: Mapping[str, float]) -> Value:
    """Settings value with some settings replaced, by dotted name."""
    changed: dict[str, Any] = {}
    for name, number in pairs.items():
        group, _, own = name.partition(".")
        changed[group] = with_values(changed.get(group, getattr(value, group)), {own: number}) if own else number
    return replace(value, **changed)


def own_values(mission: Mission, backend: str) -> Pairs:
    """Values that the mission gives to one backend's settings."""
    prefix = f"{backend}."
    return tuple((name.removeprefix(prefix), each) for name, each in mission.solve.settings if name.startswith(prefix))
