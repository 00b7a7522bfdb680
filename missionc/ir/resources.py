"""Own state of an agent: resources that motion uses and refills, and flags that places set and clear."""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir.places import Region


class Refill(Record):
    """Refill of a resource, per second of a step with both ends in the region."""

    region: Region
    per_second: float


class Resource(Record, eq=False):
    """Quantity of each of some agents, by mission index.

    At step 0 it is ``start``. A step uses ``per_second`` for each second and ``per_metre`` for each metre between its
    ends, and adds its refills. The level never exceeds ``capacity``.
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
    """Flag of an agent: true from a step in ``set_in`` until a step in ``cleared_in``.

    A step in both sets it.
    """

    name: str
    agents: tuple[int, ...]
    set_in: Region
    cleared_in: Region | None
    span: Span
