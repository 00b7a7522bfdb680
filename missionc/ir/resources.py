"""State of an agent's own: resources that a motion uses up and fills, and flags that places set and clear."""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir.places import Region


class Refill(Record):
    """What a step adds, for each second, to a resource of an agent that is in the region at both its ends."""

    region: Region
    per_second: float


class Resource(Record, eq=False):
    """A number that each of some agents has, by mission index.

    At step 0 it is ``start``. A step takes ``per_second`` of it for each second and ``per_metre`` for each metre from
    one end to the other, and adds what the refills say; it never exceeds ``capacity``.
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
    """True of an agent from a step in ``set_in`` on, until a step in ``cleared_in``; a step in both sets it."""

    name: str
    agents: tuple[int, ...]
    set_in: Region
    cleared_in: Region | None
    span: Span
