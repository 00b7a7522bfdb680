"""Own state of an agent: resources that motion consumes and regions refill, and flags that regions set and clear."""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir.places import Region


class Refill(Record):
    """Refill of a resource: amount per second during steps that begin and end in the region."""

    region: Region
    per_second: float


class Resource(Record, eq=False):
    """Consumable quantity that each of some agents (mission indices) has, such as battery charge.

    At step 0 the level is ``start``. A step consumes ``per_second`` for each second and ``per_metre`` for each metre
    between its ends, and adds its refills. The level never exceeds ``capacity``.
    """

    name: str
    agents: tuple[int, ...]
    start: float
    capacity: float
    per_second: float
    per_metre: float
    refills: tuple[Refill, ...]
    span: Span


class Flag(Record, eq=False):
    """Flag of an agent: true from a step with the agent in ``set_in`` until a step with the agent in ``cleared_in``.

    A step in both regions sets the flag.
    """

    name: str
    agents: tuple[int, ...]
    set_in: Region
    cleared_in: Region | None
    span: Span
